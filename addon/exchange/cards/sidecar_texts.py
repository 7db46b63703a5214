"""The texts of the sidecar: how to read and draw cards."""

from __future__ import annotations

ATLAS = {
    "tiles_are": "strips of hair, counted along rows from the lower left; each card shows one",
    "padding_is": "fraction of a tile's width, and of its height, that is left empty on each side",
    "root": "the lower end of a tile",
}
DRAW_ORDER = {
    "order": "pieces of cards from the inside to the outside of the hair; draw the indices in the "
    "order of the file. In levels with cards_in_order, the triangles of each card are contiguous",
    "first": "all opaque meshes, including the head, before the first hair pass",
    "valid_while": "the hair keeps its place on the head; sort swinging hair at run time: "
    "triangles by the distance of their centres from the eye, the farthest first",
    "keep": "index order; optimizers that reorder triangles for vertex caches destroy it",
}
BACK_ORDER = (
    "by the second order of each level: in the pass of transparent back faces draw the indices "
    "from buffer_back_first of the index buffer; back faces lie on the far side of the hair, so "
    "this order runs from the outside inwards"
)
SHADING = {
    "model": "Scheuermann 2004; T from root to tip, N, L, V unit vectors, H = normalize(L + V)",
    "diffuse": "max(0, 0.75 dot(N, L) + 0.25)",
    "shifted_tangent": "normalize(T + shift N); positive moves the highlight to the tip",
    "specular": "smoothstep(-1, 0, dot(T, H)) pow(sqrt(1 - dot(T, H)^2), exponent)",
    "sum": "base rgb colour occlusion / pi times light times (diffuse + diffuse (primary + "
    "secondary)), the highlights by strength, colour, exponent and shift in material.values",
}
MATERIAL = {
    "fibre_are": "marschner only. root: absorption per radius, factor of a root of absorption; "
    "tip: the same for the tips, fraction of absorption in a grey strand; strengths of R, TT, TRT "
    "and the rest. colour = exp(-root(absorption) factor). Light of lamps: times min(1, 2 "
    "occlusion), and besides the lobes fake_scattering colour / (1 + colour) / pi times diffuse. "
    "Ambient light: times 0.056 R occlusion + s / (1 + 1.1 s), s = 3.9 occlusion^0.6 colour^0.9",
    "tables_are": "marschner only; as stored, clamped, the lowest row first. longitudinal: column "
    "theta_i, row theta_r, each from -pi/2 to pi/2; M_R, M_TT, M_TRT, cos theta_d. azimuthal, "
    "paths: column cos theta_d from 0 to 1, row phi from 0 to pi; N_R, N_TT, N_TRT, N_rest and "
    "l_TT, l_TRT, v_TRT, l_rest. The ends of each axis are texel centres",
}
TEXTURES = {
    "place": "the lowest row of a picture is v = 0, counted from below: the root",
    "shift_and_noise": "if they are separate textures, they repeat in u and v",
}
VIEW_COMPENSATED_ALPHA = (
    "alpha is the coverage by strands, averaged over all rotations of a card about its tangent. "
    "When shading a card seen at a slant, its coverage is 1 - (1 - alpha)^(mean_facing / max(f, "
    "min_facing)); f is |dot(n, e)| of the normal n of its plane and the unit vector e to the "
    "eye, made perpendicular to the tangent"
)
#: role of a texture -> its color space in files of integers, and its meaning
ROLES = {
    "color": (
        "sRGB",
        "base colour for a plain material: the strands' own colour, darkened by the shadows "
        "between them; base and the values of the material are for hair shaders",
    ),
    "base": (
        "sRGB",
        "multiplied by gain, a factor on the hair's colour; with Marschner, use an absorption of "
        "(root(absorption) - log(base) / factor)^2",
    ),
    "alpha": (
        "linear",
        "coverage, straight alpha; 0 at both sides of a tile, opaque in its middle",
    ),
    "shift": ("linear", "moves both highlights: shift + shift_noise (value - 0.5)"),
    "noise": ("linear", "breaks up the second highlight: multiply it by mix(1, value, sparkle)"),
    "tangent": (
        "linear",
        "direction of a strand, d = 2 rgb - 1: x across the card along u, y from root to tip, z "
        "along the normal. Used instead of shift: T = normalize(d.x across + d.y along + "
        "shift_noise d.z normal)",
    ),
    "normal": (
        "linear",
        "normal of a strand in the axes of tangent; with two channels d.z is root(1 - d.x^2 - "
        "d.y^2)",
    ),
    "depth": ("linear", "0.5 in the card's plane, larger towards the outside"),
    "along": ("linear", "from 0 at the root to 1 at the tip of the visible strand"),
    "strand_id": ("linear", "random number of each strand, from 0 to 1"),
    "occlusion": (
        "linear",
        "ambient occlusion among the strands of a card, from 0 enclosed to 1 open",
    ),
}
ENGINES = {
    "three.js": "draws blended double-sided materials twice, back faces first; "
    "material.forceSinglePass = true draws the file's order once",
    "Godot": "gives blended materials a depth pre-pass; set Transparency to Alpha for the file's "
    "order in one pass",
    "levels": "all levels are in the same place: show one at a time. GLB lists the coarser ones "
    "in MSFT_lod, outside of its scene; FBX has them in a LOD group, USD in a variant set, OBJ as "
    "objects. The names of the nodes end in _LOD0, _LOD1 and so on",
    "others": "one blended double-sided pass in index order is nearly right from every side",
}
