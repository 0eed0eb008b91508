"""Strict reading of a user's values: an unknown or non-physical value becomes one clear error message."""

from collections.abc import Mapping
from typing import Any, Literal, TypeVar, get_origin

from pydantic import BaseModel, ConfigDict, Field, ValidationError
from pydantic.fields import FieldInfo

from models.core.errors import InputError, nearest_names_phrase, suggestion_phrase


class Strict(BaseModel):
    """Base class of every table that a user may write: immutable, finite numbers only, no unknown key, no silent
    conversion."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False, strict=True)


Query = Literal["mass", "size", "inertia", "strut", "load", "stiffness", "frequency", "damping"]
"""Names of the plausibility checks of a vehicle (``models.vehicles.plausible``)."""


def accepted_queries_field() -> Any:
    """Model field for the plausibility queries about a vehicle that its user has seen and accepted."""
    return Field(default=[], description="queries about the vehicle that are meant so: they are not told again")


LARGEST_QUANTITY = 1e15
"""Largest accepted magnitude of a physical quantity in SI units; products of two such values are still finite."""


def quantity(unit: str, meaning: str, *, default: Any = ..., zero: bool = False, signed: bool = False) -> Any:
    """Model field for a physical quantity in SI units: positive, or non-negative (``zero``), or of either sign
    (``signed``), and of plausible magnitude."""
    exclusive_least, least = (None, -LARGEST_QUANTITY) if signed else (None, 0) if zero else (0, None)
    return Field(
        default,
        description=meaning,
        json_schema_extra={"unit": unit},
        gt=exclusive_least,
        ge=least,
        le=LARGEST_QUANTITY,
    )


Model = TypeVar("Model", bound=BaseModel)


def read(table_class: type[Model], table_values: Mapping[str, Any], file: object, key_path: str = "") -> Model:
    """Build ``table_class`` from a user's table; raises InputError that names file, place, value and what is allowed.

    Of several errors the first is told in full, an unknown key before all others, and the rest are named.
    """
    if not isinstance(table_values, Mapping):
        raise InputError(file, key_path, table_values, ERROR_SENTENCES["dict_type"])
    try:
        return table_class.model_validate(dict(table_values))
    except ValidationError as error:
        raise input_error_from_faults(error, table_class, file, key_path) from None


def input_error_from_faults(
    validation_error: ValidationError, table_class: type[BaseModel], file: object, key_path: str
) -> InputError:
    """One InputError from all faults that pydantic listed for a user's table."""
    first, *other_faults = sorted(validation_error.errors(), key=lambda fault: fault["type"] != "extra_forbidden")
    keys = _keys_of_error(first)
    value = None if first["type"] == "missing" else first["input"]
    allowed = _allowed_phrase(first, keys, _owning_model(table_class, keys))
    other_keys = [
        _dotted_key(key_path, _keys_of_error(fault))
        for fault in other_faults
        if f"mean {_keys_of_error(fault)[-1]!r}" not in allowed
    ]
    further_text = (
        f"; also wrong: {', '.join(other_keys[:5])}{', ...' if len(other_keys) > 5 else ''}" if other_keys else ""
    )
    return InputError(file, _dotted_key(key_path, keys), value, allowed + further_text)


def _keys_of_error(pydantic_fault: Any) -> tuple[str, ...]:
    """Nested keys of the value that an error of pydantic concerns."""
    return tuple(str(key) for key in pydantic_fault["loc"])


def _dotted_key(key_path: str, nested_keys: tuple[str, ...]) -> str:
    """Nested keys joined with dots, below ``key_path``."""
    return ".".join((*((key_path,) if key_path else ()), *nested_keys))


def _owning_model(table_class: type[BaseModel], nested_keys: tuple[str, ...]) -> type[BaseModel] | None:
    """The model class of the table that holds the last key; None if no class of the project describes it."""
    parents = iter(nested_keys[:-1])
    for key in parents:
        field = table_class.model_fields.get(key)
        inner = None if field is None else _inner_model(field.annotation)
        if field is None or inner is None:
            return None
        if get_origin(field.annotation) in (dict, list):
            next(parents, None)  # a name that the user chose, or a place in a list
        table_class = inner
    return table_class


def _inner_model(type_annotation: Any) -> type[BaseModel] | None:
    """The model class in a type annotation, also within a list, dict or union; None if there is none."""
    options = (type_annotation, *getattr(type_annotation, "__args__", ()))
    return next((o for o in options if isinstance(o, type) and issubclass(o, BaseModel)), None)


def _allowed_phrase(first_fault: Any, nested_keys: tuple[str, ...], owning_model: type[BaseModel] | None) -> str:
    """Phrase that says which keys or values would have been accepted."""
    fields = {} if owning_model is None else owning_model.model_fields
    key = nested_keys[-1] if nested_keys else ""
    kind, facts = first_fault["type"], _unit_and_meaning(fields.get(key))
    if kind == "extra_forbidden":
        known = tuple(name for name, field in fields.items() if not field.exclude)
        return "unknown key" + (nearest_names_phrase(key, known) or ": this table takes none")
    if kind == "missing":
        return f"is missing{facts}"
    if kind == "literal_error":
        names = tuple(
            phrase.strip().strip("'") for phrase in first_fault["ctx"]["expected"].replace(" or ", ", ").split(",")
        )
        return f"must be {' or '.join(names)}{facts}{suggestion_phrase(first_fault['input'], names)}"
    if kind == "value_error":
        return f"{first_fault['ctx']['error']}{facts}"
    return ERROR_SENTENCES.get(kind, "is not accepted here").format(**first_fault.get("ctx", {})) + facts


ERROR_SENTENCES = {
    "float_type": "must be a number",
    "int_type": "must be a whole number",
    "int_from_float": "must be a whole number",
    "finite_number": "must be a finite number",
    "string_type": "must be text in quotes",
    "bool_type": "must be true or false",
    "list_type": "must be a list in [ ]",
    "too_short": "must hold at least {min_length} value(s)",
    "too_long": "must hold at most {max_length} value(s)",
    "string_too_short": "must not be empty",
    "tuple_type": "must be a list in [ ]",
    "dict_type": "must be a table of keys and values",
    "model_type": "must be a table of keys and values",
    "greater_than": "must be above {gt:g}",
    "greater_than_equal": "must be {ge:g} or more",
    "less_than": "must be below {lt:g}",
    "less_than_equal": "must be at most {le:g}",
}
"""Phrases on what is allowed, by the kind of error that pydantic reports."""


def _unit_and_meaning(table_field: FieldInfo | None) -> str:
    """Meaning and unit of a scene key, as text in brackets; empty if there are none."""
    if table_field is None:
        return ""
    extra = table_field.json_schema_extra
    unit = f"in {extra['unit']}" if isinstance(extra, dict) and extra.get("unit") else ""
    description = ", ".join(phrase for phrase in (table_field.description or "", unit) if phrase)
    return f" ({description})" if description else ""
