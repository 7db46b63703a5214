"""The texts of the sidecar: how to read and draw cards."""

from __future__ import annotations

ATLAS = {
    "tiles_are": "strips of hair, counted along rows from the lowest left one; each card shows one",
    "padding_is": "fraction of a tile's width, and of its height, that is left free on each side",
    "root": "the lower end of a tile",
}
DRAW_ORDER = {
    "order": "pieces of cards from the inside to the outside of the hair; draw the indices as they "
    "stand. Where a level has cards_in_order, all triangles of a card follow each other",
    "first": "all opaque meshes, the head included, before the first hair pass",
    "valid_while": "the hair keeps its place on the head; hair that swings is to be sorted at run "
    "time: triangles by the distance of their middles from the eye, the farthest first",
    "keep": "index order; optimisers that reorder triangles for vertex caches destroy it",
}
BACK_ORDER = (
    "by the second order of each level: in the pass of transparent back faces draw the indices "
    "from buffer_back_first of the index buffer; back faces lie on the far side of the hair, so "
    "theirs come from the outside inwards"
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
    "fibre_are": "marschner alone. root: absorption per radius, factor of a root of absorption; "
    "tip: the same of the tips, fraction of absorption that a grey strand has; strengths of R, TT, "
    "TRT and the rest",
    "tables_are": "marschner alone; as they are stored, clamped, the lowest row first. "
    "longitudinal: column theta_i, row theta_r, each from -pi/2 to pi/2; M_R, M_TT, M_TRT, cos "
    "theta_d. azimuthal, paths: column cos theta_d from 0 to 1, row phi from 0 to pi; N_R, N_TT, "
    "N_TRT, N_rest and l_TT, l_TRT, v_TRT, l_rest. The ends of an axis are centres of texels",
}
TEXTURES = {
    "place": "the lowest row of a picture is v = 0, counted from below: the root",
    "shift_and_noise": "where they are textures of their own they repeat in u and v",
}
VIEW_COMPENSATED_ALPHA = (
    "alpha is what strands cover on the mean of all turns of a card about its tangent. Seen at a "
    "slant, when its shading is drawn, it covers 1 - (1 - alpha)^(mean_facing / max(f, "
    "min_facing)); f is |dot(n, e)| of the normal n of its plane and the way e to the eye made "
    "perpendicular to the tangent, a unit vector"
)
#: role of a texture -> its color space in files of integers, and its meaning
ROLES = {
    "color": (
        "sRGB",
        "what a plain material shows: the strands' own colour, as much darker as shadows between "
        "them make it; base and the values of the material are for shaders of hair",
    ),
    "base": (
        "sRGB",
        "times gain it is what the hair's colour is multiplied by; with Marschner by an absorption "
        "of (root(absorption) - log(base) / factor)^2",
    ),
    "alpha": ("linear", "straight coverage; 0 at both sides of a tile, opaque in its middle"),
    "shift": ("linear", "moves both highlights: shift + shift_noise (value - 0.5)"),
    "noise": ("linear", "breaks up the second highlight: times mix(1, value, sparkle)"),
    "tangent": (
        "linear",
        "the way of a strand, d = 2 rgb - 1: x across the card along u, y from root to tip, z "
        "along the normal. In place of shift: T = normalize(d.x across + d.y along + shift_noise "
        "d.z normal)",
    ),
    "normal": (
        "linear",
        "the normal of a strand in the axes of tangent; with two channels d.z is root(1 - d.x^2 - "
        "d.y^2)",
    ),
    "depth": ("linear", "0.5 in the card's plane, larger nearer to the outside"),
    "along": ("linear", "0 at the root to 1 at the tip of the strand that is seen"),
    "strand_id": ("linear", "a number of its own for each strand, from 0 to 1"),
    "occlusion": ("linear", "ambient occlusion among the strands of a card, 0 shut in to 1 open"),
}
ENGINES = {
    "three.js": "draws blended double-sided materials twice, back faces first; "
    "material.forceSinglePass = true draws the file's order once",
    "Godot": "gives blended materials a depth pre-pass; set Transparency to Alpha for the file's "
    "order in one pass",
    "levels": "all levels lie in one place: show one. GLB names the coarser ones by MSFT_lod, "
    "outside of its scene; FBX has them in a LOD group, USD in a variant set, OBJ as objects. The "
    "nodes' names end in _LOD0, _LOD1 and so on",
    "others": "one blended double-sided pass in index order is nearly right from every side",
}
