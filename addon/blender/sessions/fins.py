"""The live session of one fin: an artist's mesh that moves as cloth.

A session holds numbers and arrays, never a reference into Blender's data.
"""

from __future__ import annotations

from collections.abc import Callable

import bpy
import numpy as np

from ...arrays import Floats
from ...dynamics.cloth.settings import FinSettings
from ...dynamics.cloth.state import ClothState, vertex_rows
from ...dynamics.cloth.step import advance_cloth, cloth_at_frame_end
from ...dynamics.frame import Drive
from ...errors import HairloomError
from ...rig_flow import Solids
from ..bakes.groom_hashes import collider_places, collider_shapes, frame_rate, mesh_parts
from ..bakes.simulation import CLOTH_VERSION, Arrays, hashes
from ..base.mesh_arrays import triangle_vertices
from ..base.objects import Body, matrix_of, objects_in
from ..base.vertex_weights import read_weights
from ..colliders.scene_colliders import SceneColliders
from ..properties.properties import settings_of
from ..scene.fin_mesh import check_usable, corners_of, loose_edges_of
from ..scene.fin_modifier import clear, fin_modifier, has_fins, read_carried, show
from ..scene.forces import force_fields_of, gravity_of
from .fabrics import ClothMesh, FabricJob


class FinSession:
    """One fin, while it is previewed or baked; see `simulation.Simulation`.

    Raises:
        HairloomError: not a mesh with our modifier, or one that cannot be cloth.
    """

    def __init__(self, obj: bpy.types.Object, depsgraph: bpy.types.Depsgraph) -> None:
        self.body = Body.at_rest(obj, depsgraph)
        self.is_playing = False
        self.is_stale = False
        self.scene_colliders: SceneColliders | None = None
        self.state: ClothState | None = None
        self._fabric = FabricJob()
        self._earlier: Floats | None = None
        self._check_mesh(obj)
        self._corners = corners_of(obj.data)
        self.rest(depsgraph)

    @property
    def uid(self) -> int:
        return self.body.handle.uid

    @property
    def name(self) -> str:
        return self.body.handle.name

    @property
    def bodies(self) -> tuple[Body, ...]:
        """See `simulation.Simulation`."""
        return (self.body,)

    @property
    def is_made(self) -> bool:
        """Whether its fabric is not being made at the moment."""
        return not self._fabric.is_pending

    @property
    def settings(self) -> FinSettings:
        return settings_of(self.body.resolve().hairloom.fin, FinSettings)

    def rest(self, depsgraph: bpy.types.Depsgraph) -> None:
        """Show the mesh where the animation carries it, without velocity."""
        obj = self._found()
        self._shown, self._matrix = self._read(obj, depsgraph)
        self._carried, self._earlier = self._world(), None
        self._duration = 0.0
        _, self._field_notes = force_fields_of(obj, depsgraph)
        self.is_stale = False
        clear(obj.data)
        if self.state is not None:
            position = np.ascontiguousarray(self._carried.T)
            self.state = ClothState(position, position, self.state.fabric)
        if self.is_playing and self.scene_colliders is not None:
            self.scene_colliders.rest(depsgraph)

    def play(
        self, depsgraph: bpy.types.Depsgraph, *, blocking: bool = True, is_frame: bool = False
    ) -> None:
        """Get ready to be simulated; edges keep the lengths that they have now."""
        obj = self._found()
        self._corners = corners_of(obj.data)
        self.state = None
        self.rest(depsgraph)
        mesh = ClothMesh(
            self._carried,
            triangle_vertices(obj.data),
            self._pins(obj, depsgraph),
            loose_edges_of(obj.data),
        )
        fabric = self._named(lambda: self._fabric.fabric_of(mesh, blocking=blocking))
        position = vertex_rows(self._carried)
        self.state = ClothState(position, position, fabric)
        settings = self.settings.as_dynamics()
        self.scene_colliders = SceneColliders.of(
            obj, None, None, settings, depsgraph, self.scene_colliders, blocking=blocking
        )
        self.is_playing = True

    def stop(self, depsgraph: bpy.types.Depsgraph) -> None:
        """End the simulation; the mesh is where the animation carries it."""
        self.is_playing = False
        self.forget()
        obj = self.body.handle.find()
        if obj is not None and obj.type == "MESH":
            clear(obj.data)

    def forget(self) -> None:
        """Give up its fabric, if that is being made."""
        self._fabric.cancel()

    def advance(self, depsgraph: bpy.types.Depsgraph, duration: float) -> None:
        """Simulate the time [s] in which everything moved to where it is now.

        Raises:
            HairloomError: an object that it needs is gone or has changed.
        """
        obj, state = self._found(), self.state
        assert state is not None and self.scene_colliders is not None, "play comes first"
        earlier, before = self._earlier, self._carried
        self._shown, self._matrix = self._read(obj, depsgraph)
        now = self._world()
        fields, self._field_notes = force_fields_of(obj, depsgraph)
        drive = Drive(
            before,
            now,
            self.scene_colliders.move(depsgraph, duration),
            gravity_of(depsgraph.scene),
            earlier if duration else None,
            fields,
            self._duration / duration if duration else 1.0,
        )
        self.state = self._named(lambda: advance_cloth(state, drive, self.settings, duration))
        self._earlier, self._carried, self._duration = before, now, duration
        self._show(obj, self._object_space(cloth_at_frame_end(self.state, drive)))

    @property
    def warnings(self) -> tuple[str, ...]:
        """Warnings about its colliders, force fields and pins."""
        known = () if self.scene_colliders is None else self.scene_colliders.warnings
        known += self._field_notes
        if self.state is None or self.state.fabric.pin.any():
            return known
        text = f"{self.name}: no vertex is pinned, so it falls. Choose a Pin Group with weights."
        return (*known, text)

    def normals(self) -> Floats:
        """Unit vertex normals of the cloth, (vertex_count, 3) world, at the last substep."""
        assert self.state is not None, "play comes first"
        return self.state.normals()

    def constants(self) -> Arrays:
        """See `simulation.Simulation`."""
        return {"corners": self._corners}

    def bake_arrays(self) -> Arrays:
        """The vertices of this frame, (vertex_count, 3) float32, object space."""
        return {"position": self._shown.copy()}

    def show_recorded(self, frame: Arrays, solids: Solids | None = None) -> None:
        """See `simulation.Simulation`; cloth is not led out of colliders.

        Raises:
            HairloomError: the frame is of another mesh.
        """
        obj, position = self._found(), np.asarray(frame["position"], np.float32)
        if position.shape != (len(obj.data.vertices), 3):
            raise HairloomError(
                f"its bake has {len(position):,} vertices, but the mesh has "
                f"{len(obj.data.vertices):,}",
                place=self.name,
                remedy="Bake again",
            )
        self._show(obj, position)

    def rig_hash(self, depsgraph: bpy.types.Depsgraph) -> str:
        """See `simulation.Simulation`."""
        obj = self._found()
        modifiers = [(each.type, each.name) for each in obj.modifiers if each.show_viewport]
        return hashes(
            mesh=(*mesh_parts(obj), repr(modifiers)),
            pins=self._pins(obj, depsgraph),
            colliders=collider_shapes(obj, None),
            frame_rate=frame_rate(depsgraph.scene),
            solver=str(CLOTH_VERSION),
        )

    def frame_hash(self, depsgraph: bpy.types.Depsgraph) -> str:
        """See `simulation.Simulation`."""
        obj = self._found()
        carried, matrix = self._read(obj, depsgraph)
        return hashes(
            pose=(carried, matrix),
            settings=self.settings,
            colliders=collider_places(obj, None, depsgraph),
            forces=(gravity_of(depsgraph.scene), force_fields_of(obj, depsgraph)[0].table),
        )

    def _found(self) -> bpy.types.Object:
        """The object, with the mesh that the session was made for.

        Raises:
            HairloomError: it is gone, in another mode, or has another mesh.
        """
        obj = self.body.resolve()
        self._check_mesh(obj)
        return obj

    def _check_mesh(self, obj: bpy.types.Object) -> None:
        check_usable(obj, self.body.handle)
        if self.state is not None and not np.array_equal(corners_of(obj.data), self._corners):
            raise HairloomError(
                "its faces or vertices have changed, so the cloth cannot go on",
                place=obj.name,
                remedy="Play again",
            )

    def _read(self, obj: bpy.types.Object, depsgraph: bpy.types.Depsgraph) -> tuple[Floats, Floats]:
        """Where the animation carries the mesh: (vertex_count, 3) object space; matrix (4, 4)."""
        carried, matrix = read_carried(obj, depsgraph), matrix_of(obj, depsgraph)
        if not np.isfinite(matrix).all() or np.linalg.cond(matrix[:3, :3]) > 1.0e6:
            raise HairloomError(
                "its scale is zero or not a number", place=obj.name, remedy="Correct its transform"
            )
        return carried, matrix

    def _world(self) -> Floats:
        """The shown vertices, (vertex_count, 3) float64 world [m]."""
        shown = self._shown.astype(np.float64)
        return shown @ self._matrix[:3, :3].T + self._matrix[:3, 3]

    def _object_space(self, points: Floats) -> Floats:
        inverse = np.linalg.inv(self._matrix)
        return (points @ inverse[:3, :3].T + inverse[:3, 3]).astype(np.float32)

    def _show(self, obj: bpy.types.Object, positions: Floats) -> None:
        self._shown = positions
        show(obj.data, positions)

    def _pins(self, obj: bpy.types.Object, depsgraph: bpy.types.Depsgraph) -> Floats:
        """(vertex_count,) float32."""
        name, count = obj.hairloom.fin.pin_group, len(obj.data.vertices)
        if not name:
            return np.zeros(count, np.float32)
        return read_weights(obj, depsgraph, name)[:count]

    def _named[T](self, action: Callable[[], T]) -> T:
        """Run an action; its errors name this object."""
        try:
            return action()
        except HairloomError as error:
            raise HairloomError(error.problem, place=self.name, remedy=error.remedy) from error


def any_enabled(layer: bpy.types.ViewLayer) -> bool:
    """Whether a fin of this view layer is to be simulated."""
    return has_fins() and any(obj.hairloom.fin.enabled for obj in fins_in(layer))


def fins_in(layer: bpy.types.ViewLayer) -> list[bpy.types.Object]:
    """The objects of a view layer that are fins, by their modifier."""
    return [obj for obj in objects_in(layer) if fin_modifier(obj) is not None]
