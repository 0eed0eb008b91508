"""Result of a run for users of the library: printing, display in notebooks, plots, and conversion to tables."""

import json
from dataclasses import dataclass
from html import escape
from typing import TYPE_CHECKING

import numpy as np

from models.core import result as saved
from models.core.assumptions import BrokenAssumption, assumption_sentences, broken_assumptions_of
from models.core.discretisation import Estimate, error_estimates_of
from models.core.errors import InputError
from models.core.told import figure_remarks, messages_on_results

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr
    from matplotlib.axes import Axes

SUMMARY_CHANNELS = 20
"""Largest number of channels with a row in a result's summary; further channels are only named."""
TITLE_WIDTH = 90
"""Largest number of characters in a line of a plot's title."""


@dataclass(frozen=True, repr=False)
class Result(saved.Result):
    """Result of a run; ``result["f1"]`` is a channel's array, ``result.data`` the xarray Dataset with units and
    meanings."""

    def __getitem__(self, channel: str) -> np.ndarray:
        """Values of a channel or of an axis; raises InputError with the most similar name for an unknown channel."""
        self._check(channel)
        return super().__getitem__(channel)

    def _check(self, *channels: str) -> None:
        names = tuple(str(name) for name in self.data.variables)
        for channel in channels:
            if channel not in names:
                raise InputError("", "channel", channel, "no such channel", names)

    @property
    def errors(self) -> dict[str, Estimate]:
        """Estimated error of each channel, with its unit; empty if no errors were estimated."""
        return error_estimates_of(self)

    @property
    def broken(self) -> list[BrokenAssumption]:
        """Assumptions that the run broke, each with place, duration, size, and remedy."""
        return broken_assumptions_of(self)

    @property
    def assumed(self) -> list[str]:
        """Sentences of all assumptions that were checked in the run, broken or not."""
        return assumption_sentences(self)

    @property
    def _label(self) -> str:
        return str(self.data.attrs.get("engine") or self.data.attrs.get("system", "result"))

    def _state_lines(self) -> list[str]:
        """Lines of a result's summary: status, counts, doubts about run and input, errors and broken assumptions."""
        attributes = self.data.attrs
        counts = ", ".join(f"{count} {name}" for name, count in json.loads(attributes.get("counts", "{}")).items())
        seconds = f"{attributes['seconds']:.3f} s" if attributes.get("seconds") else ""
        parts = "; ".join(text_part for text_part in (str(attributes.get("status", "")), counts, seconds) if text_part)
        texts = json.loads(attributes.get("doubts", "[]"))
        queries = [query for query in json.loads(attributes.get("queries", "[]")) if query["text"] not in texts]
        doubts = [f"  in doubt: {text}" for text in texts] + [
            f"  {query['weight']}: {query['text']}" for query in queries
        ]
        system_and_engine = dict.fromkeys(str(attributes.get(key, "")) for key in ("system", "engine"))
        return [
            f"  {' '.join(filter(None, system_and_engine))}: {parts}",
            *doubts,
            *messages_on_results({self._label: self}),
        ]

    def _rows(self) -> list[tuple[str, str, str, str, str, str]]:
        """Texts of name, unit, axes, least value, largest value and meaning of each channel."""
        rows = []
        for name, channel in self.data.data_vars.items():
            axes = " x ".join(f"{axis} {size}" for axis, size in channel.sizes.items())
            limits = _limit_texts(channel.values)
            unit, meaning = (str(channel.attrs.get(key, "")) for key in ("units", "long_name"))
            rows.append((str(name), unit or "-", axes or "-", *limits, meaning))
        return rows

    def __repr__(self) -> str:
        heads = ("channel", "unit", "axes", "least", "largest", "meaning")
        rows = [heads, *self._rows()]
        widths = [max(len(row[i]) for row in rows[: SUMMARY_CHANNELS + 1]) for i in range(len(heads))]
        table = ["  " + "  ".join(map(str.ljust, row, widths)).rstrip() for row in rows[: SUMMARY_CHANNELS + 1]]
        names_not_shown = [row[0] for row in rows[SUMMARY_CHANNELS + 1 :]]
        omitted_line = [f"  and {len(names_not_shown)} more: {', '.join(names_not_shown)}"] if names_not_shown else []
        return "\n".join([str(self.data.attrs.get("title", "")), *self._state_lines(), *table, *omitted_line])

    def _repr_html_(self) -> str:
        title = escape(str(self.data.attrs.get("title", "")))
        state_html = "<br>".join(escape(line.strip()) for line in self._state_lines())
        heads = "".join(f"<th>{head}</th>" for head in ("channel", "unit", "axes", "least", "largest", "meaning"))
        rows = "".join("<tr>" + "".join(f"<td>{escape(cell)}</td>" for cell in row) + "</tr>" for row in self._rows())
        return f"<p><b>{title}</b><br>{state_html}</p><table><tr>{heads}</tr>{rows}</table>"

    def plot(self, *channels: str, axes: "Axes | None" = None) -> "Axes":
        """Plot channels of one unit over their axis, with a line for each row of a channel with several; returns the
        axes.

        axes : of matplotlib, into which lines are drawn; new ones if there are none. What the run broke stands in the
        title. Raises InputError for unknown channels, for text, and for channels of several units.
        """
        from studies.command.comparison import channels_of

        if not channels:
            raise InputError("", "plot", None, "name one channel or more", tuple(map(str, self.data.data_vars)))
        self._check(*channels)
        curves = dict(channels_of(self.data.reset_coords()[list(channels)]))
        kinds = {(curve.unit, curve.grid_name) for curve in curves.values()}
        if len(kinds) != 1:
            kinds_text = " and ".join(sorted(f"{unit or '-'} over {axis_name}" for unit, axis_name in kinds)) or "text"
            raise InputError("", "plot", ", ".join(channels), f"holds {kinds_text}: plot numbers of one unit at a time")
        if axes is None:
            from matplotlib import pyplot

            axes = pyplot.subplots(layout="constrained")[1]
        for name, curve in curves.items():
            axes.plot(curve.grid, curve.values, "o" if len(curve.grid) == 1 else "-", label=name)
        ((unit, axis_name),) = kinds
        meaning = str(self.data[channels[0]].attrs.get("long_name", "")) if len(channels) == 1 else ""
        axes.set(xlabel=axis_name, ylabel=f"{meaning or ', '.join(channels)} [{unit or '-'}]")
        self._set_title(axes)
        if len(curves) > 1:
            axes.legend()
        return axes

    def _set_title(self, axes: "Axes") -> None:
        """Set the plot's title: the scene's title, the engine, and warnings about the result."""
        from textwrap import fill

        texts = (f"{self.data.attrs.get('title', '')}, {self._label}", *figure_remarks({self._label: self}))
        axes.set_title("\n".join(fill(text, TITLE_WIDTH) for text in texts), fontsize="small")

    def to_pandas(self, *channels: str) -> "pd.DataFrame":
        """Table with channels over the same axes as columns; all channels if none is named.

        The index holds the axes; units stand in ``frame.attrs["units"]``. Raises InputError for channels over different
        axes.
        """
        self._check(*channels)
        chosen = self.data[list(channels)] if channels else self.data
        axes: dict[tuple[str, ...], list[str]] = {}
        for name, channel in chosen.data_vars.items():
            axes.setdefault(tuple(map(str, channel.dims)), []).append(str(name))
        if len(axes) > 1:
            groups = "; ".join(
                f"over {', '.join(dims) or 'nothing'}: {', '.join(names)}" for dims, names in axes.items()
            )
            raise InputError("", "to_pandas", None, f"name channels that lie over the same axes ({groups})")
        frame = chosen.to_dataframe() if next(iter(axes), ()) else chosen.expand_dims("row").to_dataframe()
        frame.attrs["units"] = {str(name): str(c.attrs.get("units", "")) for name, c in chosen.variables.items()}
        return frame

    def to_xarray(self) -> "xr.Dataset":
        """Copy of all channels with their axes, units and meanings."""
        return self.data.copy(deep=True)


def _limit_texts(channel_values: np.ndarray) -> tuple[str, str]:
    """Texts of the least and the largest finite number of a channel."""
    if channel_values.dtype.kind not in "fiub":
        return "text", ""
    finite = channel_values[np.isfinite(channel_values)]
    return (f"{finite.min():.5g}", f"{finite.max():.5g}") if finite.size else ("none", "none")
