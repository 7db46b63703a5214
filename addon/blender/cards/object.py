"""Hair cards as mesh objects in the artist's scene, one for each level of detail.

Objects are made once, and later only their mesh is filled again: the object, its modifiers and
materials, and whatever else the artist has added stay. Copies are the artist's and are never
filled, whatever their names. The mesh is in the space of the hair object, so an object that was
moved aside stays there.
"""

from __future__ import annotations

import bpy
import numpy as np
from mathutils import Matrix

from ...arrays import Floats
from ...cards.build import CardBuild
from ...cards.card_mesh import CARD_FIELDS, CardMesh
from ...cards.edits import UNPRINTED, CardRecord, EditCounts, piece_prints
from ...errors import HairloomError
from ...shading.settings import ShadingSettings
from ..base.attributes import set_attribute
from ..base.objects import Handle, check_shape_editable, head_of, link_into, matrix_of
from ..base.thread_work import ThreadWork
from ..colliders.rigs import CachedRig
from ..scene.surfaces import OCCLUSION_LAYER
from .build import MappedCards, order_line, read_inputs
from .build_cache import CardBuildCache
from .edits import MADE_ATTRIBUTE, TILE_LAYER, forget_record, read_pieces, write_record
from .made_objects import card_objects
from .material import fill_image, new_material
from .mesh import OCCLUSION_IS_OURS, fill_mesh


class CardObjectJob:
    """Makes the cards of one groom: reads the inputs here, builds in a thread, and then writes.

    objects: of the cards once they are written, finest first. order: see `order_line`.
    notes: for the artist. edits: counts of cards that are kept as the artist left them.

    Args:
        keep_edits: whether to keep the artist's changes to existing cards.
        cached_rigs: see `CachedRig.of`.
        cache: cards that were built before; the new ones are kept in it.

    Raises:
        HairloomError: no hair that can be used, or its existing cards cannot be changed.
    """

    def __init__(
        self,
        hair: bpy.types.Object,
        depsgraph: bpy.types.Depsgraph,
        *,
        keep_edits: bool = True,
        cached_rigs: tuple[CachedRig, ...] = (),
        cache: CardBuildCache | None = None,
    ) -> None:
        for obj in card_objects(hair):
            _check_replaceable(obj)
        self._inputs, self.notes, self.dropped = read_inputs(
            hair, depsgraph, keep_edits=keep_edits, cached_rigs=cached_rigs
        )
        self._cache = CardBuildCache() if cache is None else cache
        self._hair, self._matrix = Handle.of(hair), matrix_of(hair, depsgraph)
        self.objects: list[bpy.types.Object] = []
        self.order = ""
        self.edits = EditCounts()

    def building(self) -> ThreadWork[MappedCards]:
        """Build the cards in a thread, which touches none of Blender's data."""
        return self._cache.building(self._inputs, "hairloom card objects")

    def write(self, made: MappedCards) -> None:
        """Put the cards into the scene.

        Raises:
            HairloomError: the hair is gone, or its cards cannot be changed any more.
        """
        hair, build = self._hair.resolve("Choose other hair"), made.build
        self._cache.keep(self._hair, self._inputs, made)
        for obj in card_objects(hair):
            _check_replaceable(obj)
        self.notes += tuple(f"{hair.name}: {note}." for note in made.notes)
        card = made.maps.plain_card(self._inputs.settings[ShadingSettings])
        self.objects = _write(hair, build, card, self._matrix)
        self.order, self.edits = order_line(build.wrong_fraction), build.edits


def _check_replaceable(obj: bpy.types.Object) -> None:
    """Raises:
    HairloomError: its mesh cannot be replaced.
    """
    check_shape_editable(obj)
    if obj.mode != "OBJECT":
        raise HairloomError(
            "its mesh is being edited", place=obj.name, remedy="Go back to Object Mode"
        )
    if obj.data.shape_keys is not None:
        raise HairloomError(
            "it has shape keys, which would move new cards to the places of the old ones",
            place=obj.name,
            remedy="Apply or delete them (Object Data > Shape Keys > Apply All, Delete All)",
        )


def _write(
    hair: bpy.types.Object,
    build: CardBuild,
    texture: Floats,
    matrix: Floats,
) -> list[bpy.types.Object]:
    """Fill the objects of this groom's cards, make missing ones and remove superfluous ones."""
    there = {obj.hairloom.card_object.level: obj for obj in reversed(card_objects(hair))}
    for level in [level for level in there if level >= len(build.levels)]:
        _remove(there.pop(level))
    first = there.get(0)
    known = None if first is None else first.hairloom.card_object.image
    image = _filled_image(known, f"{hair.name} Cards", texture)
    objects, material = [], _first_material(first)
    for level, cards in enumerate(build.levels):
        obj = there.get(level)
        if obj is None:
            material = material or _new_material(f"{hair.name} Cards", image)
            obj = _new_object(hair, level, matrix)
            obj.data.materials.append(material)
        obj.hairloom.card_object.image = image
        obj.hairloom.card_object.card_count = cards.card_count
        obj.hairloom.card_object.shell_layers = build.shell_layers
        obj.hairloom.card_object.wrong_fraction = build.wrong_fraction
        _fill(obj.data, cards, matrix)
        if not level and build.record is not None:
            _write_card_record(obj.data, build.record, cards, matrix)
        elif not level:
            forget_record(obj.data)
        objects.append(obj)
    return objects


def _new_material(name: str, image: bpy.types.Image) -> bpy.types.Material:
    """The initial material of cards; afterwards it is the artist's."""
    return new_material(name, image, image, blending="DITHERED", occlusion="occlusion")


def _first_material(obj: bpy.types.Object | None) -> bpy.types.Material | None:
    return obj.data.materials[0] if obj is not None and len(obj.data.materials) else None


def _remove(obj: bpy.types.Object) -> None:
    mesh = obj.data
    bpy.data.objects.remove(obj)
    if not mesh.users:
        bpy.data.meshes.remove(mesh)


def _new_object(hair: bpy.types.Object, level: int, matrix: Floats) -> bpy.types.Object:
    """An object without geometry beside the hair, with the same carrier as parent; coarser levels
    are hidden."""
    name = f"{hair.name} Cards" + (f" LOD{level}" if level else "")
    obj = bpy.data.objects.new(name, bpy.data.meshes.new(name))
    link_into(obj, hair.users_collection, bpy.context.scene)
    card_object = obj.hairloom.card_object
    card_object.groom, card_object.level = hair, level
    card_object.made_name, card_object.made_uid = obj.name, obj.session_uid
    carrier = head_of(hair) or hair.parent
    if carrier is not None:
        obj.parent = carrier
        obj.matrix_parent_inverse = carrier.matrix_world.inverted_safe()
    obj.matrix_basis = Matrix(matrix.tolist())
    if level:
        obj.hide_viewport = obj.hide_render = True
    return obj


def _fill(mesh: bpy.types.Mesh, cards: CardMesh, matrix: Floats) -> None:
    mesh[OCCLUSION_IS_OURS] = True
    fill_mesh(
        mesh,
        cards,
        uv_maps={
            TILE_LAYER: cards.uv,
            OCCLUSION_LAYER: np.stack([cards.occlusion, cards.along], 1),
        },
        points={"occlusion": cards.occlusion, "along": cards.along},
        faces={"card": cards.card}
        | {name: getattr(cards, name)[cards.card] for name in CARD_FIELDS},
        matrix=matrix,
    )


def _write_card_record(
    mesh: bpy.types.Mesh, record: CardRecord, cards: CardMesh, matrix: Floats
) -> None:
    """Write the record by which the artist's changes to these cards are found later."""
    is_made = cards.card < len(record)
    set_attribute(mesh, MADE_ATTRIBUTE, "FACE", np.where(is_made, cards.card + 1, 0))
    surface, number = read_pieces(mesh)
    assert number is not None
    # all of the artist's own cards together count as one more card
    found = piece_prints(surface, np.where(number < 0, len(record), number))
    prints = record.prints.copy()
    unprinted = np.flatnonzero(prints == UNPRINTED)
    prints[unprinted] = found[unprinted]
    write_record(mesh, record, prints, matrix)


def _filled_image(image: bpy.types.Image | None, name: str, texture: Floats) -> bpy.types.Image:
    """An image with this texture, packed into the file.

    Args:
        image: the one to overwrite, or None for a new one.
        texture: (height, width, 4) linear with straight alpha, row 0 the lowest.
    """
    height, width = texture.shape[:2]
    if image is None or image.library is not None:
        image = bpy.data.images.new(name, width, height, alpha=True)
    image.alpha_mode = "CHANNEL_PACKED"  # first, since Blender then reloads the packed picture
    if tuple(image.size) != (width, height):
        image.scale(width, height)
    fill_image(image, texture)
    image.update()
    image.pack()
    return image
