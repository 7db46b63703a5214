"""Fixtures of the Blender tests: an empty scene, the extension, small grooms."""

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest

bpy = pytest.importorskip("bpy", reason="these tests need Blender or the bpy module")

from engine_stage import SIZE, set_world  # noqa: E402
from function_cache import cache_function  # noqa: E402
from hedgehogs import hedgehog  # noqa: E402

import hairloom  # noqa: E402  it is loaded by tests/conftest.py
from hairloom.addon import light_flow, registration  # noqa: E402
from hairloom.addon.blender.cards import motion  # noqa: E402
from hairloom.addon.blender.colliders import spheres  # noqa: E402
from hairloom.addon.blender.command_line import inputs  # noqa: E402
from hairloom.addon.blender.sessions import solvers  # noqa: E402
from hairloom.addon.cards import build as card_build  # noqa: E402
from hairloom.addon.dynamics.colliders import DistanceField  # noqa: E402
from hairloom.addon.groom import child_roots  # noqa: E402
from hairloom.addon.render import skin_layouts  # noqa: E402
from hairloom.addon.shading import density_grid, skin_seen  # noqa: E402
from hairloom.addon.strands import StrandSet  # noqa: E402


@pytest.fixture(autouse=True, scope="session")
def cached_distance_fields() -> Iterator[Any]:
    """Build the distance field of each mesh once for all tests: a field takes seconds, most tests
    use the same head, and tests/pure covers the fields themselves. Yields the original
    `from_surface`."""
    made: dict[tuple[Any, ...], DistanceField] = {}
    make = DistanceField.from_surface

    def found(surface: Any, settings: Any, **place: str) -> DistanceField:
        corner = surface.positions[surface.triangles].astype(np.float64)
        volume = np.linalg.det(corner).sum() / 6.0
        # Blender may triangulate equal quads along either diagonal
        shape = surface.positions.tobytes(), len(corner), round(volume, 9)
        key = (*shape, settings.collider_resolution)
        if key not in made:
            made[key] = make(surface, settings, **place)
        return made[key]

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(DistanceField, "from_surface", found)
        yield make


@pytest.fixture(autouse=True, scope="session")
def cached_functions() -> Iterator[None]:
    """Cache slow functions that depend on their arguments alone: most tests use the same hair on
    the same head, and tests/pure covers these functions."""

    def cells() -> tuple[int, int]:
        return density_grid._MAX_CELLS, skin_seen._CELLS

    with pytest.MonkeyPatch.context() as patch:
        for name in ("sky_field", "openness_field", "skin_field"):
            cache_function(patch, light_flow, name, extra_key=cells)
        for name in ("raise_between_rows", "wrong_fraction"):
            cache_function(patch, card_build, name)
        for name in ("grow", "grow_with_face"):
            cache_function(patch, inputs, name)
        cache_function(patch, child_roots, "_roots_among")
        cache_function(patch, skin_layouts, "skin_layout")
        cache_function(patch, spheres, "fit_spheres")
        cache_function(patch, motion, "fit_spheres")
        yield


@pytest.fixture(autouse=True)
def empty_scene() -> None:
    """An empty file with an empty undo stack."""
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)


@pytest.fixture(autouse=True)
def numpy_by_default(request: pytest.FixtureRequest) -> Iterator[None]:
    """Simulate hair with numpy, except in tests that draw or request a GPU: software drivers take
    up to a minute to compile the shader, and whether an earlier test has started the GPU varies."""
    with pytest.MonkeyPatch.context() as patch:
        if not (request.node.get_closest_marker("draws") or "gpu_context" in request.fixturenames):
            patch.setattr(solvers, "can_compute", lambda: False)
        yield


@pytest.fixture(autouse=True)
def coarse_light(request: pytest.FixtureRequest) -> Iterator[None]:
    """Compute the light within hair on a coarse grid, except in tests that look at drawn light: it
    takes most of the time that a few strands need to prepare. tests/pure covers the light
    itself."""
    draws = request.node.get_closest_marker("draws")
    with pytest.MonkeyPatch.context() as patch:
        if draws is None or not draws.kwargs.get("light", True):
            patch.setattr(density_grid, "_MAX_CELLS", 4_000)
            patch.setattr(skin_seen, "_CELLS", 12)
        yield


_is_enabled = False


@pytest.fixture
def extension(empty_scene: None) -> Iterator[None]:
    """Hairloom registered, as when its extension is enabled: once, and reset after each test."""
    global _is_enabled
    if not _is_enabled:
        hairloom.register()
        _is_enabled = True
    yield
    registration.end_all()


@pytest.fixture
def no_extension(empty_scene: None) -> None:
    """Hairloom not registered, for tests that register and unregister it themselves."""
    global _is_enabled
    if _is_enabled:
        hairloom.unregister()
        _is_enabled = False


@pytest.fixture
def sphere() -> Any:
    """A UV sphere of radius 0.1 m with UVs, named Head."""
    bpy.ops.mesh.primitive_uv_sphere_add(radius=0.1, segments=24, ring_count=12)
    head = bpy.context.object
    head.name = "Head"
    return head


@pytest.fixture
def new_hair(extension: None) -> Callable[..., Any]:
    """A function that makes hair curves on a head or without one, by default a hedgehog."""
    from hairloom.addon.blender.scene.curves import write_curves

    def make(head: Any = None, strands: StrandSet | None = None) -> Any:
        strands = hedgehog() if strands is None else strands
        hair = write_curves("Hair", strands, head, bpy.context.collection)
        # automatic widths and children would turn so few strands into a full head of hair
        hair.data.hairloom.widths.method = "own"
        hair.data.hairloom.children.method = "none"
        for other in bpy.context.selected_objects:
            other.select_set(False)
        hair.select_set(True)
        bpy.context.view_layer.objects.active = hair
        return hair

    return make


@pytest.fixture
def preview(new_hair: Any, sphere: Any, get_depsgraph: Any) -> tuple[Any, Any, Any]:
    """Hair on a head, previewed: (hair, head, session)."""
    from hairloom.addon.blender.preview import previews

    hair = new_hair(sphere)
    return hair, sphere, previews.start(hair, get_depsgraph())


@pytest.fixture
def get_depsgraph() -> Callable[[], Any]:
    """A function that returns the current evaluated dependency graph."""
    return lambda: bpy.context.evaluated_depsgraph_get()


@pytest.fixture
def engine_scene(extension: None) -> Any:
    """A scene with a camera 1 m in front of the origin, rendered by our engine."""
    scene = bpy.context.scene
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.location, camera.rotation_euler = (0.0, -1.0, 0.0), (np.pi / 2.0, 0.0, 0.0)
    camera.data.clip_start = 0.01
    scene.collection.objects.link(camera)
    scene.camera = camera
    scene.world = bpy.data.worlds.new("World")
    set_world((0.5, 0.5, 0.5))
    render = scene.render
    render.engine = "HAIRLOOM"
    render.resolution_x = render.resolution_y = SIZE
    render.resolution_percentage = 100
    render.dither_intensity = 0.0
    scene.hairloom.picture.samples = 4
    return scene


@pytest.fixture
def flag_object(extension):
    """A flat sheet of 11 x 11 vertices, 0.4 m wide, made a fin that is pinned along its -x edge."""
    bpy.ops.mesh.primitive_grid_add(x_subdivisions=10, y_subdivisions=10, size=0.4)
    obj = bpy.context.object
    obj.name = "Flag"
    group = obj.vertex_groups.new(name="Pins")
    group.add([v.index for v in obj.data.vertices if v.co.x < -0.19], 1.0, "REPLACE")
    assert bpy.ops.hairloom.fin_add() == {"FINISHED"}
    return obj
