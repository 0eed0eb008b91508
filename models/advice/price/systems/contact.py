"""Price of accuracy of a user's rolling contact, or table of contacts: the number of cells and the integration scheme
across them.

The truth is the scene's own theory on ever finer cells: what the theory itself leaves out is no part of the price.
"""

from dataclasses import dataclass
from functools import partial
from itertools import islice

import numpy as np

from models.advice.price import PricedRun, SettingLadder
from models.advice.price.problem import Setting
from models.core.errors import InputError
from models.core.tables import RowBlock, table_blocks
from models.systems.contact.cases_table import BY_AXES, BY_CURVATURES, OUTPUT_COLUMNS, solved_rows
from models.systems.contact.run import inputs_of_table_contacts, run
from models.systems.contact.scene import ContactMethod, ContactScene

PRICED_ROWS = 1000
"""Number of rows of a table, the first ones, in which the price is computed."""
CELLS_TRIED = (5, 7, 9, 11, 15, 21, 31, 45, 63, 91, 127, 181, 255)
"""Numbers of cells along each axis that are tried, beside the scene's number."""
REFERENCE_CELLS = (25, 50, 100, 200, 400)
"""Numbers of cells along each axis on the reference's rungs."""
MARCHES_OF_THEORY = {"fastsim": ("second-order", "plain"), "simplified": ("",)}
"""Contact theories whose cells can be chosen, with the integration schemes ("marches") of each."""
UNIT_OF_CHANNEL = {"fx": "N", "fy": "N", "mz": "N m"}
USUAL_QUANTITY = "fx,fy"


@dataclass(frozen=True, eq=False)
class PricedContact:
    """A contact as a priced scene, see ``models.advice.price.PricedScene``. channels : of the quantity; table_rows :
    the rows of a table that can be solved; None for one contact at its creepages.
    """

    scene: ContactScene
    channels: tuple[str, ...]
    table_rows: RowBlock | None
    kink_period = 0.0
    full_duration = searched_duration = 1.0
    work_count_name = "contact cells"

    @property
    def title(self) -> str:
        """Title of the scene."""
        return self.scene.title

    @property
    def quantity(self) -> str:
        """Channels to which the tolerance applies, as text."""
        return " and ".join(self.channels)

    @property
    def unit(self) -> str:
        """Unit that all channels of the quantity share."""
        return UNIT_OF_CHANNEL[self.channels[0]]

    @property
    def extent_text(self) -> str:
        """Text on where the quantity is computed: at every creepage, or in the first rows of a table."""
        return (
            "at every creepage"
            if self.table_rows is None
            else f"in the first {len(self.table_rows.lines):,} sound rows"
        )

    @property
    def note(self) -> str:
        """Text on what the price leaves out: the error of the contact theory."""
        return "errors are those of cells: how far the theory is off stands beside the forces of a run"

    def setting_ladders(self) -> list[SettingLadder]:
        """Ladders of cell numbers for every integration scheme of the scene's theory."""
        name, usual = self.scene.method.name, self.scene.method
        values = tuple(1.0 / n for n in sorted({*CELLS_TRIED, usual.cells}))
        return [
            SettingLadder(
                name,
                march or name,
                values,
                self._convergence_order(march),
                default=self._default_cell_share(march),
                cells=True,
            )
            for march in MARCHES_OF_THEORY[name]
        ]

    def _default_cell_share(self, march_name: str) -> float:
        return 1.0 / self.scene.method.cells if march_name in ("", self.scene.method.march) else 0.0

    def _convergence_order(self, march_name: str) -> int:
        return int(self._method(march_name, self.scene.method.cells).order)

    def reference_ladder(self) -> SettingLadder:
        """Ladder of the reference: cells that halve, with the integration scheme of the highest order."""
        name = self.scene.method.name
        march = MARCHES_OF_THEORY[name][0]
        values = tuple(1.0 / n for n in REFERENCE_CELLS)
        change_text = "half the cells change it by"
        return SettingLadder(
            name, march or name, values, self._convergence_order(march), cells=True, change_text=change_text
        )

    def second_setting(self, reference_setting: Setting) -> Setting | None:
        """None: no other family of methods computes the same contact theory."""
        return None

    def _method(self, march_name: str, cell_count: int) -> ContactMethod:
        update = {"cells": cell_count, **({"march": march_name} if march_name in MARCHES_OF_THEORY["fastsim"] else {})}
        return self.scene.method.model_copy(update=update)

    def solve(self, setting: Setting, duration: float) -> tuple[np.ndarray, int]:
        """Values (n, k) of the channels with a setting, and the number of cells evaluated in all rows."""
        method = self._method(setting.method, round(1.0 / setting.value))
        if self.table_rows is None:
            contact = run(self.scene.model_copy(update={"method": method}), error=False)
            values = np.column_stack([contact[name] for name in self.channels])
        else:
            answered = solved_rows(self.table_rows, partial(inputs_of_table_contacts, self.scene), method, False)[
                "forces"
            ]
            values = answered[:, [OUTPUT_COLUMNS.index(name) for name in self.channels]]
        return values, len(values) * method.cells**2

    def priced_run(self, solution: tuple[np.ndarray, int]) -> PricedRun:
        """The channels in the form of a run, with rows in place of times; a single row is repeated, since a run needs
        two times.
        """
        values, cells = solution
        values = np.repeat(values, 2, axis=0) if len(values) == 1 else values
        return PricedRun(np.linspace(0.0, 1.0, len(values)), values, {"steps": len(values), "contact cells": cells})

    def scene_file_lines(self, setting: Setting) -> list[str]:
        """Lines of a scene file that set the number of cells and the integration scheme."""
        march = [f'march = "{setting.method}"'] if setting.method in MARCHES_OF_THEORY["fastsim"] else []
        return ["[method]", f"cells = {round(1.0 / setting.value)}", *march]


def priced_scene(scene: ContactScene, quantity: str | None, engines: tuple[str, ...]) -> PricedContact:
    """The contact scene with a quantity to price: forces fx, fy in the plane of the contact, or the moment mz."""
    channels = tuple(name.strip() for name in (quantity or USUAL_QUANTITY).split(","))
    for name in channels:
        if name not in UNIT_OF_CHANNEL:
            raise InputError("--quantity", "", name, "is nothing that cells change", tuple(UNIT_OF_CHANNEL))
    if len({UNIT_OF_CHANNEL[name] for name in channels}) > 1:
        allowed = "has forces and a moment, of two units: one tolerance cannot hold for both"
        raise InputError("--quantity", "", ",".join(channels), allowed)
    if scene.method.name not in MARCHES_OF_THEORY:
        allowed = "has no cells that could be chosen by their price; the study contact_price compares all theories"
        raise InputError(scene.file, "method.name", scene.method.name, allowed, tuple(MARCHES_OF_THEORY))
    return PricedContact(scene, channels, None if scene.cases is None else _sound_rows(scene))


def _sound_rows(scene: ContactScene) -> RowBlock:
    """The first rows of a table of contacts, without those that the theory refuses; InputError where none remain."""
    file = scene.cases_file()
    for block in islice(table_blocks(file, (BY_AXES, BY_CURVATURES), PRICED_ROWS), 1):
        coarse = scene.method.model_copy(update={"cells": CELLS_TRIED[0]})
        wrong = solved_rows(block, partial(inputs_of_table_contacts, scene), coarse, False)["wrong"]
        sound = np.setdiff1d(np.arange(len(block.lines)), wrong)
        if len(sound):
            columns = {name: column[sound] for name, column in block.values.items()}
            return RowBlock([block.lines[i] for i in sound], columns, {})
    raise InputError(file, "", None, f"has no sound row among its first {PRICED_ROWS:,}")
