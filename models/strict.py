"""Reading a user's values strictly: unknown or non-physical ones become one clear message."""

from collections.abc import Mapping
from typing import Any, TypeVar

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from models.errors import InputError, nearest


class Strict(BaseModel):
    """Base of everything a user may write: frozen, finite, no unknown key, no silent conversion."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False, strict=True)


def quantity(unit: str, meaning: str, *, default: Any = ..., zero: bool = False, signed: bool = False) -> Any:
    """Field of a physical quantity in SI: positive, or from zero on, or of either sign."""
    bound: dict[str, float] = {} if signed else {"ge": 0} if zero else {"gt": 0}
    extra = {"unit": unit}
    return Field(default, description=meaning, json_schema_extra=extra, **bound)  # type: ignore[arg-type]


Model = TypeVar("Model", bound=BaseModel)


def read(model: type[Model], values: Mapping[str, Any], file: object, place: str = "") -> Model:
    """Build ``model`` from a user's table; raises InputError that names file, place, value and what is allowed."""
    if not isinstance(values, Mapping):
        raise InputError(file, place, values, "must be a table of keys and values")
    try:
        return model.model_validate(dict(values))
    except ValidationError as error:
        raise _message(error, model, values, file, place) from None


def _message(error: ValidationError, model: type[BaseModel], values: Any, file: object, place: str) -> InputError:
    first = error.errors()[0]
    keys = tuple(str(part) for part in first["loc"])
    where = ".".join((*((place,) if place else ()), *keys))
    unit, meaning = _facts(model, keys)
    if first["type"] == "extra_forbidden":
        return InputError(file, where, first["input"], f"unknown key{nearest(keys[-1], _owner(model, keys))}")
    if first["type"] == "missing":
        return InputError(file, where, None, f"missing{meaning}{unit}")
    return InputError(file, where, first["input"], _allowed(first) + meaning + unit, _choices(first))


def _owner(model: type[BaseModel], keys: tuple[str, ...]) -> tuple[str, ...]:
    """Names of the fields beside an unknown key."""
    for key in keys[:-1]:
        field = model.model_fields.get(key)
        inner = _inner(field.annotation) if field else None
        if inner is None:
            return ()
        model = inner
    return tuple(model.model_fields)


def _inner(annotation: Any) -> type[BaseModel] | None:
    options = (annotation, *getattr(annotation, "__args__", ()))
    return next((o for o in options if isinstance(o, type) and issubclass(o, BaseModel)), None)


def _facts(model: type[BaseModel], keys: tuple[str, ...]) -> tuple[str, str]:
    for key in keys[:-1]:
        field = model.model_fields.get(key)
        inner = _inner(field.annotation) if field else None
        if inner is None:
            return "", ""
        model = inner
    field = model.model_fields.get(keys[-1]) if keys else None
    if field is None:
        return "", ""
    extra = field.json_schema_extra
    unit = f" in {extra['unit']}" if isinstance(extra, dict) and "unit" in extra else ""
    return unit, f": {field.description}" if field.description else ""


def _allowed(first: Any) -> str:
    """What pydantic would have accepted, in plain words."""
    text: str = first["msg"]
    for prefix in ("Value error, ", "Input should be ", "Input "):
        text = text.removeprefix(prefix)
    if first["type"].startswith("value_error"):
        return text
    if first["type"] == "literal_error":
        return "not one of the accepted names"
    return f"must be {text}"


def _choices(first: Any) -> tuple[str, ...]:
    if first["type"] != "literal_error":
        return ()
    return tuple(part.strip().strip("'") for part in first["ctx"]["expected"].replace(" or ", ", ").split(","))
