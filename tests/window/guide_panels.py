"""The panels in each picture of docs/user_guide.md, panel_NAME.png.

Names are those of classes after HAIRLOOM_PT_. A picture is made of columns; a column has open
panels below each other. tests/blender/test_user_guide.py tests that none is missing.
"""

PICTURES: dict[str, tuple[tuple[str, ...], ...]] = {
    "data": (("data",),),
    "look": (
        ("data_look", "data_look_look_first", "data_look_look_second"),
        ("data_look_look_rim", "data_look_look_tips", "data_look_look_variation"),
        ("data_look_look_wet", "data_look_look_fibre", "data_look_look_light"),
    ),
    "shadows": (("data_shadows",), ("data_shadows_skin", "data_shafts")),
    "grow": (("data_grow",),),
    "strands": (
        ("data_strands", "data_detail", "data_guides"),
        ("data_children", "data_children_partings", "data_children_flow", "data_children_trim"),
    ),
    "dynamics": (
        ("data_dynamics", "data_dynamics_style"),
        ("data_dynamics_medium", "data_dynamics_lengths", "data_dynamics_shot"),
        ("data_dynamics_collisions", "data_dynamics_ties", "data_dynamics_bake"),
    ),
    "cards": (
        ("data_cards", "data_cards_card_strips"),
        ("data_cards_card_texture",),
        ("data_cards_card_occlusion", "data_cards_card_drawing"),
    ),
    "show": (("data_show", "data_export"),),
    "physics": (("collider", "fin"), ("fin_bake",)),
    "engine": (
        ("engine_sampling", "engine_mesh_shadows", "engine_motion_blur", "engine_film"),
        ("engine_passes", "hair_passes"),
    ),
    "hair_scene": (("hair_scene",),),
    "preview": (("sidebar",),),
    "warnings": (("sidebar",),),
    "meshes": (("sidebar_mesh_cards", "sidebar_fin"), ("sidebar_fin_bake",)),
}
#: pictures without panels: the window, popups, options in the file browser, and handles in the view
OTHER_PICTURES = ("window", "start", "check", "sort", "export_cards", "export_strands")
OTHER_PICTURES += ("preferences", "handles")
#: sections that are also in the sidebar; their pictures are of Properties > Data
SIDEBAR_TWINS = (
    "sidebar_look",
    "sidebar_grow",
    "sidebar_dynamics",
    "sidebar_show",
    "sidebar_cards",
    "sidebar_export",
)


def is_pictured(name: str) -> bool:
    """Whether a panel's class, or its twin in Properties > Data, is in a picture."""
    short = name.removeprefix("HAIRLOOM_PT_")
    if short.startswith(SIDEBAR_TWINS):
        short = short.replace("sidebar_", "data_", 1)
    return any(short in column for columns in PICTURES.values() for column in columns)
