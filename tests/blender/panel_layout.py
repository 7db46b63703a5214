"""Layout of a panel without a window: its height in rows, and its texts."""

from typing import Any


class Layout:
    """Replaces Blender's UILayout: a row is 1 high, and items side by side count once.

    texts: text and fraction of the panel's width of each label, button and field.
    """

    def __init__(self, texts: list[tuple[str, float]], width: float = 1.0, *, is_row: bool = False):
        self.texts, self.width, self.is_row = texts, width, is_row
        self.parts: list[float | Layout] = []
        self.scale_y = 1.0

    def __setattr__(self, name: str, value: Any) -> None:
        object.__setattr__(self, name, value)  # active, enabled, use_property_split and others

    @property
    def height(self) -> float:
        heights = [one.height if isinstance(one, Layout) else one for one in self.parts]
        total = (max(heights, default=0.0) if self.is_row else sum(heights)) * self.scale_y
        return float(total)

    def _inner(self, *, is_row: bool, width: float | None = None) -> "Layout":
        inner = Layout(self.texts, self.width if width is None else width, is_row=is_row)
        self.parts.append(inner)
        return inner

    def row(self, **_: Any) -> "Layout":
        return self._inner(is_row=True)

    def column(self, **_: Any) -> "Layout":
        return self._inner(is_row=False)

    box = column

    def split(self, **_: Any) -> "Layout":
        return self._inner(is_row=True)

    def _element(self, text: str) -> None:
        self.texts.append((text, self.width))
        self.parts.append(1.0)

    def label(self, text: str = "", **_: Any) -> None:
        self._element(text)

    def operator(self, name: str, text: str | None = None, **_: Any) -> Any:
        self._element(name if text is None else text)
        return type("Properties", (), {})()

    def prop(self, data: Any, name: str, text: str | None = None, **_: Any) -> None:
        self._element(data.bl_rna.properties[name].name if text is None else text)

    def prop_enum(self, data: Any, name: str, value: str) -> None:
        self._element(data.bl_rna.properties[name].enum_items[value].name)

    def menu(self, name: str, text: str = "", **_: Any) -> None:
        self._element(text)

    def progress(self, text: str = "", **_: Any) -> None:
        self._element(text)

    def template_ID(self, *_: Any, text: str = "", **__: Any) -> None:
        self._element(text)

    def template_list(self, *_: Any, rows: int = 5, **__: Any) -> None:
        self.parts.append(rows + 0.5)

    def template_icon_view(self, *_: Any, scale: float = 1.0, **__: Any) -> None:
        self.parts.append(scale)

    def separator(self, **_: Any) -> None:
        self.parts.append(0.5)
