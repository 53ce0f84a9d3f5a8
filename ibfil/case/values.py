"""The kinds of value in a case: numbers and formulas as text, words, lists. Each kind reads itself.

A kind stands in a type hint, ``Annotated[float, Number()]``, and gives pydantic the reader, the JSON Schema,
the listing and the messages their words: one place, so they cannot disagree.
"""

from __future__ import annotations

from dataclasses import dataclass
from types import NoneType, UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin

from pydantic import BaseModel, Discriminator, GetCoreSchemaHandler, GetJsonSchemaHandler, Tag, ValidationInfo
from pydantic_core import CoreSchema, PydanticCustomError, core_schema

from .expressions import COPIED, BrokenParameter, Expression, ExpressionError, Parameters, parse, suggestion

NUMBER = "a number (or constant expression)"
SMALLEST, LARGEST = 1e-60, 1e60  # beyond, products of a few numbers overflow or vanish


def refuse(why: str = "") -> PydanticCustomError:
    """The error of a value that is not allowed; ``why`` says more than that it is not, or is empty."""
    return PydanticCustomError("refused", "{why}", {"why": why})


def read_expression(value: Any, variables: tuple[str, ...], parameters: Parameters | None) -> Expression:
    """``value`` as an Expression. Raises the error of a value that is not allowed."""
    try:
        expression = parse(value, variables, parameters)
    except BrokenParameter:
        raise PydanticCustomError("told", "uses a parameter that is at fault") from None
    except ExpressionError as error:
        raise refuse(str(error) if isinstance(value, str) else "") from None
    if abs(expression.constant or 0.0) > LARGEST:
        raise refuse(f"larger than {LARGEST:g} in size")
    return expression


@dataclass(frozen=True)
class Kind:
    """One kind of value. ``words`` are the texts that stand for themselves and are not expressions."""

    words: tuple[str, ...] = ()

    def says(self) -> str:
        """The allowed values, for messages and the listing."""
        return " or ".join([self._values(), *(f'"{word}"' for word in self.words)])

    def _values(self) -> str:
        """The allowed values besides the words."""
        raise NotImplementedError

    def _schema(self) -> list[dict[str, Any]]:
        """The JSON Schemas of which a value meets at least one, the words' excepted."""
        raise NotImplementedError

    def _take(self, value: Any, parameters: Parameters | None) -> Any:
        """The value read. Raises PydanticCustomError where it is not allowed."""
        raise NotImplementedError

    def _enter(self, value: Any, info: ValidationInfo) -> Any:
        if isinstance(value, str) and value in self.words:
            return value
        try:
            return self._take(value, info.context)
        except PydanticCustomError as error:
            hint = suggestion(value, self.words) if isinstance(value, str) else ""
            raise (refuse(hint.removeprefix("; ")) if hint else error) from None

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        return core_schema.with_info_plain_validator_function(
            self._enter, serialization=core_schema.plain_serializer_function_ser_schema(plain)
        )

    def __get_pydantic_json_schema__(self, schema: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        options = self._schema() + ([{"enum": list(self.words)}] if self.words else [])
        return {"anyOf": options} if len(options) > 1 else options[0]


def plain(value: Any) -> Any:
    """A value as TOML or JSON would hold it: an Expression as its number, or as its text where it is none."""
    if isinstance(value, Expression):
        return value.text if value.constant is None else value.constant
    return value


@dataclass(frozen=True)
class Number(Kind):
    """A finite float, or a text with a constant expression; above ``low`` (or at it, unless ``open``)."""

    low: float | None = None
    open: bool = True

    def _values(self) -> str:
        return NUMBER + ("" if self.low is None else f" {'>' if self.open else '>='} {self.low:g}")

    def _schema(self) -> list[dict[str, Any]]:
        bound = {} if self.low is None else {"exclusiveMinimum" if self.open else "minimum": self.low}
        return [{"type": "number", **bound}, {"type": "string", "description": "a constant expression"}]

    def _take(self, value: Any, parameters: Parameters | None) -> float:
        number = read_expression(value, (), parameters).constant
        assert number is not None  # no variables were allowed
        if self.low is not None and (number <= self.low if self.open else number < self.low):
            raise refuse(f"which is {number:.6g}" if isinstance(value, str) else "")
        if self.low == 0 and self.open and number < SMALLEST:
            raise refuse(f"smaller than {SMALLEST:g}")
        return number


@dataclass(frozen=True)
class Whole(Kind):
    """An int, or a text with a constant expression of one; at least ``low``, or one of ``choices``."""

    low: int = 0
    choices: tuple[int, ...] = ()

    def _values(self) -> str:
        if self.choices:
            return " or ".join(map(str, self.choices))
        return f"a whole number (or constant expression) >= {self.low}"

    def _schema(self) -> list[dict[str, Any]]:
        whole = {"enum": list(self.choices)} if self.choices else {"type": "integer", "minimum": self.low}
        return [whole, {"type": "string", "description": "a constant expression"}]

    def _take(self, value: Any, parameters: Parameters | None) -> int:
        number = read_expression(value, (), parameters).constant
        assert number is not None  # no variables were allowed
        fits = number in self.choices if self.choices else number >= self.low
        if isinstance(value, float) or not number.is_integer() or not fits:
            raise refuse(f"which is {number:.6g}" if isinstance(value, str) else "")
        return int(number)


@dataclass(frozen=True)
class Formula(Kind):
    """A number or an expression in which ``variables`` may stand."""

    variables: tuple[str, ...] = ()
    copied: bool = False  # of a filament: i and phase may stand in it where it has copies

    def _values(self) -> str:
        return f"a number or an expression of {', '.join(self.variables)}"

    def _schema(self) -> list[dict[str, Any]]:
        return [{"type": "number"}, {"type": "string", "description": self._values()}]

    def _take(self, value: Any, parameters: Parameters | None) -> Expression:
        return read_expression(value, self.variables + (COPIED if self.copied else ()), parameters)


@dataclass(frozen=True)
class Place(Kind):
    """A word, an arclength, or where ``window`` a window [s1, s2] with s1 < s2."""

    window: bool = True

    def _values(self) -> str:
        return f"{NUMBER} >= 0" + (" or a pair [s1, s2] of them, s1 < s2" if self.window else "")

    def _schema(self) -> list[dict[str, Any]]:
        number = {"anyOf": Number(low=0, open=False)._schema()}
        pair = {"type": "array", "prefixItems": [number, number], "minItems": 2, "maxItems": 2}
        return [number, pair] if self.window else [number]

    def _take(self, value: Any, parameters: Parameters | None) -> float | tuple[float, float]:
        number = Number(low=0, open=False)
        if not isinstance(value, list):
            return number._take(value, parameters)
        if len(value) != 2 or not self.window:
            raise refuse()
        first, last = (number._take(item, parameters) for item in value)
        if first >= last:
            raise refuse("s1 is not below s2")
        return first, last


@dataclass(frozen=True)
class Listed:
    """A TOML list as a tuple, of ``length`` where given; with ``repeat`` one value stands for equal ones."""

    length: int | None = None
    repeat: bool = False

    def _read(self, value: Any) -> Any:
        if self.repeat and self.length and not isinstance(value, list | dict):
            return (value,) * self.length
        if not isinstance(value, list) or (self.length is not None and len(value) != self.length):
            raise refuse()
        return tuple(value)

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        return core_schema.no_info_before_validator_function(self._read, handler(source))

    def __get_pydantic_json_schema__(self, schema: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        whole = handler(schema)
        return {"anyOf": [whole["prefixItems"][0], whole]} if self.repeat else whole


# The hints of the schema. Items of a list are read by pydantic, so each item's fault has its own key.
Real = Annotated[float, Number()]
Positive = Annotated[float, Number(low=0)]
NotNegative = Annotated[float, Number(low=0, open=False)]
Count = Annotated[int, Whole(low=1)]
Seed = Annotated[int, Whole()]
OfS = Annotated[Expression, Formula(variables=("s",), copied=True)]
OfT = Annotated[Expression, Formula(variables=("t",), copied=True)]
OfST = Annotated[Expression, Formula(variables=("s", "t"), copied=True)]
OfSTXYZ = Annotated[Expression, Formula(variables=("s", "t", "x", "y", "z"), copied=True)]
OfI = Annotated[Expression, Formula(variables=("i",))]
OfIXYZ = Annotated[Expression, Formula(variables=("i", "x", "y", "z"))]
OfXYZT = Annotated[Expression, Formula(variables=("x", "y", "z", "t"))]
Vector = Annotated[tuple[Real, Real, Real], Listed(3)]
Sizes = Annotated[tuple[Positive, Positive, Positive], Listed(3)]
Cells = Annotated[tuple[Count, Count, Count], Listed(3)]
Range = Annotated[tuple[Real, Real], Listed(2)]
TripleS = Annotated[tuple[OfS, OfS, OfS], Listed(3)]
TripleT = Annotated[tuple[OfT, OfT, OfT], Listed(3)]
TripleST = Annotated[tuple[OfST, OfST, OfST], Listed(3)]
TripleSTXYZ = Annotated[tuple[OfSTXYZ, OfSTXYZ, OfSTXYZ], Listed(3)]
TripleXYZT = Annotated[tuple[OfXYZT, OfXYZT, OfXYZT], Listed(3)]
TripleI = Annotated[tuple[OfI, OfI, OfI], Listed(3)]
PairST = Annotated[tuple[OfST, OfST], Listed(2)]


def tagged(tag: str) -> Tag:
    """The tag of one member of a union; in brackets, so that it is never taken for a key."""
    return Tag(f"<{tag}>")


def by_kind(default: str, *kinds: str) -> Discriminator:
    """Choose among tables by their key ``kind``."""

    def choose(value: Any) -> str | None:
        kind = value.get("kind", default) if isinstance(value, dict) else None
        return f"<{kind}>" if kind in kinds else None

    return Discriminator(choose)


def describe(hint: Any, metadata: tuple[Any, ...] = ()) -> str:
    """The values that a type hint of the schema allows, in a few words."""
    for item in metadata:
        if isinstance(item, Kind):
            return item.says()
    if get_origin(hint) is Annotated:
        inner, *more = get_args(hint)
        return describe(inner, tuple(more))
    if get_origin(hint) is Literal:
        return " or ".join(f'"{word}"' for word in get_args(hint))
    if get_origin(hint) in (Union, UnionType):
        members = [member for member in get_args(hint) if member is not NoneType]
        kinds = [unwrapped(member).model_fields["kind"].default for member in members if _has_kind(member)]
        if kinds:
            return "a table with kind = " + " or ".join(f'"{kind}"' for kind in kinds)
        return " or ".join(dict.fromkeys(describe(member) for member in members))
    if get_origin(hint) is tuple:
        return _describe_list(get_args(hint), metadata)
    if isinstance(hint, type) and issubclass(hint, BaseModel):
        return "a table {" + ", ".join(keys(hint)) + "}"
    return {str: "a text in quotes", bool: "true or false"}.get(hint, "a table")


def _describe_list(items: tuple[Any, ...], metadata: tuple[Any, ...]) -> str:
    each = describe(items[0])
    if items[-1] is Ellipsis:
        return f"a list, each entry {each}"
    single = f"{each} or " if any(isinstance(item, Listed) and item.repeat for item in metadata) else ""
    return f"{single}a list of {len(items)}, each entry {each}"


def unwrapped(hint: Any) -> Any:
    """A type hint without its Annotated and its None."""
    if get_origin(hint) is Annotated:
        return unwrapped(get_args(hint)[0])
    if get_origin(hint) in (Union, UnionType):
        members = [member for member in get_args(hint) if member is not NoneType]
        return unwrapped(members[0]) if len(members) == 1 else hint
    return hint


def _has_kind(hint: Any) -> bool:
    model = unwrapped(hint)
    return isinstance(model, type) and issubclass(model, BaseModel) and "kind" in model.model_fields


def keys(model: type[BaseModel]) -> dict[str, str]:
    """The keys a table may hold -> the names of the model's fields."""
    return {info.alias or name: name for name, info in model.model_fields.items()}
