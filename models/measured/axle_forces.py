"""Vertical forces of two axles against the vehicle that they carry: sign, unit, weight, balance, order, start.

Both kinds of input go through here: a file of wheel forces of a pitch-plane scene, and a recording on that vehicle.

All forces, integrated once, give the rates of the rigid vehicle: v' = F / M - g upwards, r' = (front F1 - rear F2) /
(I + J) nose up. A true motion keeps both rates bounded, so that neither rises steadily; an error of the forces' mean
does. A vehicle that climbs a grade rises at its speed times its pitch, which is taken off v first. What is left is
fitted by a straight line over block means: its slope is the acceleration that the vehicle cannot have, and the scatter
about it says how well that is known.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from models.core.finding import Finding, Weight
from models.core.time_series import sparse
from models.drift.growth import RigidPitch, rigid_pitch
from models.measured.ratios import EMPTY, Wrong, counted_from_load, sentence
from models.measured.recording import Recording
from models.measured.signal import Signal
from models.vehicles.pitch_plane import Parameters

CHECKS = ("weight", "balance", "sign", "unit", "swapped", "start", "times", "copied", "spikes", "clipped")
"""Names of all findings, with those of the samples of a file."""
AXLES = {"front": ("front", "front left", "front right"), "rear": ("rear", "rear left", "rear right")}
"""Where vertical forces may be measured: at an axle, or at its wheels, whose forces are added."""
GRAVITY = 9.81
"""m/s^2, by which shares are told where a vehicle has another one, or none."""
BLOCKS = 16
"""Means over parts of the record: what is faster than a block says nothing of its slope."""
SMALL = 0.003
"""Share of the weight, or of the moment of an axle's load, below which nothing is said: the drift of 0.1 % is what
studies of trust are about."""
LARGE = 0.05
"""Share beyond which the forces are another vehicle's, or of another unit, if they move it far."""
HEIGHT = 1.0
"""m: a vehicle that leaves a level road further has no road under it."""
RISE, SWING = 0.5, 0.1
"""m/s and rad/s that a short record may gain steadily by its motion: entering a grade, or a bend of it."""
SCATTER = 1.5
"""Rms of the block means about the slope, gained over the record: a wave as long as the record makes 1.7 of it, and is
explained by the pitch that makes it."""
FASTEST = 60.0
"""m/s, speed of a vehicle on a grade."""
IMPOSSIBLE = 1e6
"""Weights of the vehicle that no wheel force is: a mark for no value, or a damaged file."""
LIKE = 0.02
"""Share by which a mean may differ from what an explanation predicts."""
STEEP = 0.35
"""rad: no road is steeper (36 %)."""
TURNS = 3
"""Repeated integrations of the pitch, each with the arms of the one before."""
LEAST = 0.05
"""Part of a pitch that does not rise steadily, at the least."""
OFF = 0.05
"""Share of its static load by which an axle may begin off it."""
BAND = 1.0, 25.0
"""Hz, between which both axles feel the same road one after the other."""
LAG = 0.02, 2.0
"""s, between the axles of a vehicle."""
ALIKE = 0.3
"""Correlation from which on one axle is said to repeat the other."""
COPIED = 1e-3
"""Rms of what is left of an axle's changes without the other's, by their own, up to which they are the same."""
IN_FILE: dict[Wrong, str] = {
    "sign": "forces up on the wheels are positive; turn its sign",
    "unit": "correct the unit in its header",
    "gain": "check its calibration factor",
    "size": "check its calibration factor and the vehicle's parameters",
}
"""Remedies where the column of a file, and no channel map, says what a signal is."""


@dataclass(frozen=True)
class AxleForces:
    """forces (n, 2) : front and rear, N, up on the wheels, ``period`` (s) apart. signals : of either axle.

    duration : s, of the run that they drive. remedies : what to do about a wrong sign, unit or factor, None for those
    of a channel map. rests : whether the run starts from the static equilibrium; turn : whether the forces turn with
    the chassis.
    """

    forces: np.ndarray
    period: float
    parameters: Parameters
    signals: tuple[tuple[Signal, ...], tuple[Signal, ...]]
    duration: float
    remedies: Mapping[Wrong, str] | None = None
    rests: bool = True
    turn: bool = False

    @cached_property
    def rigid(self) -> RigidPitch:
        """The vehicle as one body."""
        return rigid_pitch(self.parameters)

    @cached_property
    def loads(self) -> np.ndarray:
        """Static loads (2,) in N; those of 9.81 m/s^2 where nothing weighs."""
        return _loads(self.parameters) * (self.parameters.g or GRAVITY)

    @cached_property
    def means(self) -> np.ndarray:
        """Mean forces (2,) in N."""
        return self.forces.mean(axis=0)

    @property
    def empty(self) -> np.ndarray:
        """Which axles (2,) have a mean that is nothing beside their load and beside their own variation."""
        return (np.abs(self.means) < EMPTY * self.loads) & (np.abs(self.means) <= self.forces.std(axis=0))

    @property
    def lasted(self) -> float:
        """Time (s) of the last sample."""
        return self.period * (len(self.forces) - 1)

    @property
    def names(self) -> tuple[str, ...]:
        """Of all signals."""
        return tuple(s.name for axle in self.signals for s in axle)

    @cached_property
    def arms(self) -> np.ndarray:
        """Accelerations (2, 2), of heave (upwards) and pitch (nose up), that 1 N at the front and at the rear make."""
        own = self.rigid
        return np.array([[1 / own.mass, 1 / own.mass], [own.front / own.total, -own.rear / own.total]])

    @cached_property
    def pitch(self) -> tuple[np.ndarray, np.ndarray]:
        """Rate (n,) and pitch (n,), rad/s and rad nose up, that the forces give by themselves from rest.

        The arms of vertical forces shorten by the cosine of the pitch: put in by a few turns as long as it is small.
        """
        moments = self.forces @ self.arms[1]
        rate = self._summed(moments)
        pitch = self._summed(rate)
        for _ in range(0 if self.turn else TURNS):
            if abs(pitch).max() > STEEP:
                break
            rate = self._summed(moments * np.cos(pitch))
            pitch = self._summed(rate)
        return rate, pitch

    @cached_property
    def rise(self) -> np.ndarray:
        """Rate (n,) of the centre of mass from rest, m/s upwards."""
        pitch = self.pitch[1]
        upright = np.cos(pitch) if self.turn and abs(pitch).max() < STEEP else 1.0
        return self._summed(self.forces @ self.arms[0] * upright - self.parameters.g)

    def _summed(self, values: np.ndarray) -> np.ndarray:
        """Integral (n,) of samples (n,) from the first one on."""
        return np.concatenate(([0.0], np.cumsum(0.5 * (values[1:] + values[:-1]) * self.period)))


def axle_signals(recording: Recording, axle: str) -> list[Signal]:
    """Vertical forces of an axle: those of the axle, or of both its wheels."""
    found = [s for at in AXLES[axle] for s in recording.find("force", at, "z") if not s.check]
    whole = [signal for signal in found if signal.at == axle]
    return whole or found


def axles(recording: Recording, parameters: Parameters) -> AxleForces | None:
    """Vertical forces of both axles as the checks read them, short and long gaps bridged straight; None where one
    lacks a wheel."""
    signals = tuple(tuple(axle_signals(recording, axle)) for axle in AXLES)
    if not all(own and len(own) == (1 if own[0].at == axle else 2) for axle, own in zip(AXLES, signals, strict=True)):
        return None
    front, rear = (np.asarray(sum(_straight(recording.samples(s)) for s in own)) for own in signals)
    turn = all(s.frame != "inertial" for own in signals for s in own)
    return AxleForces(
        np.column_stack([front, rear]),
        recording.period,
        parameters,
        (signals[0], signals[1]),
        recording.duration,
        turn=turn,
    )


def _straight(values: np.ndarray) -> np.ndarray:
    """Samples (n,) with straight lines where nothing was measured; 0 where nothing was at all."""
    known = np.flatnonzero(np.isfinite(values))
    return np.interp(np.arange(len(values)), known, values[known]) if len(known) else np.zeros(len(values))


@dataclass(frozen=True)
class Steady:
    """Steady accelerations (2,) that no motion explains, m/s^2 upwards and rad/s^2 nose up, and how well each is
    known (2,): smaller ones say nothing. units (2,) : of a whole load: gravity, and the moment of one axle's load."""

    accelerations: np.ndarray
    known: np.ndarray
    units: np.ndarray

    @property
    def shares(self) -> np.ndarray:
        """Accelerations (2,) by those of a whole load."""
        return self.accelerations / self.units

    @property
    def seen(self) -> np.ndarray:
        """Which of the two (2,) is beyond what is known."""
        return np.abs(self.accelerations) > self.known


def steady(own: AxleForces) -> Steady:
    """What is left of equilibrium over the whole record.

    A rise counts only as far as neither a level road nor a climb with the pitch that the forces give explains it.
    """
    rate, pitch = own.pitch
    times = _blocks(own.lasted * np.linspace(-0.5, 0.5, len(own.forces)))
    units = np.array([GRAVITY, own.arms[1, 0] * own.loads[0] * GRAVITY / (own.parameters.g or GRAVITY)])
    level = _slope(times, _blocks(own.rise))
    climbing = _slope(times, _blocks(own.rise), _blocks(pitch)) if abs(pitch).max() < STEEP else level
    risen, turned = (
        _known(found, unit, gained, own.lasted)
        for found, unit, gained in ((level, units[0], RISE), (_slope(times, _blocks(rate)), units[1], SWING))
    )
    risen = min(risen, _known(climbing, units[0], RISE, own.lasted), key=lambda found: abs(found[0]) / found[1])
    return Steady(np.array([risen[0], turned[0]]), np.array([risen[1], turned[1]]), units)


def _known(found: tuple[float, float], unit: float, gained: float, lasted: float) -> tuple[float, float]:
    """A slope, and how well it is known, from the scatter about it."""
    return found[0], SMALL * unit + (gained + SCATTER * found[1]) / lasted


def _slope(times: np.ndarray, values: np.ndarray, pitch: np.ndarray | None = None) -> tuple[float, float]:
    """Slope of values (n,) over times (n,) in least squares, and the scatter about it.

    What a vehicle climbs with its pitch (n,), at a speed between 0 and the fastest, is fitted beside it; the scatter
    grows where a pitch that rises steadily can hardly be told from it.
    """
    values, unlike = values - values.mean(), 1.0
    if pitch is not None and np.ptp(pitch) > 0:
        climb = pitch - pitch.mean()
        steady_climb = climb @ times / (times @ times)
        own = climb - steady_climb * times
        speed = float(np.clip(own @ values / (own @ own), 0.0, FASTEST)) if own @ own > 0 else 0.0
        values = values - speed * climb
        unlike = max(float(np.sqrt((own @ own) / (climb @ climb))), LEAST)
    slope = float(times @ values / (times @ times))
    return slope, float(np.sqrt(np.mean((values - slope * times) ** 2))) / unlike


def _blocks(values: np.ndarray) -> np.ndarray:
    """Means of equal parts of values (n, ...) along the first axis."""
    parts = np.array_split(values, min(BLOCKS, max(len(values) // 2, 2)))
    return np.array([part.mean(axis=0) for part in parts])


def _loads(p: Parameters) -> np.ndarray:
    """Mass (2,) in kg that rests on either axle."""
    return np.array([p.m3 * p.a / (p.a + p.b) + p.m1, p.m3 * p.b / (p.a + p.b) + p.m2])


def check(own: AxleForces) -> list[Finding]:
    """All findings; what an earlier one explains, a later one does not name again."""
    largest = float(np.abs(own.forces).max())
    if largest > IMPOSSIBLE * own.loads.sum():
        return [
            _error(
                own,
                "weight",
                f"A wheel force of {largest:.4g} N is none of a vehicle that weighs {own.loads.sum():.4g} N.",
                largest,
                "N",
            )
        ]
    for look in (_sparse, _explained, _coarse, _balance, _start):
        found = look(own)
        if found:
            return found + _dead(own)
    return _dead(own) + _copied(own) + _order(own) or [_good(own)]


def _sparse(own: AxleForces) -> list[Finding]:
    """A long record of which a run takes next to nothing, too sparse for a wheel."""
    text = sparse(len(own.forces), own.period, own.duration)
    if not text:
        return []
    return [Finding("times", "doubt", "wheel forces", text, own.period, "s", own.names)]


def _explained(own: AxleForces) -> list[Finding]:
    """What a common mistake explains to a few per cent, at both axles."""
    p = own.parameters
    if p.g == 0:
        return []
    if own.empty.any():
        text = " ".join(
            counted_from_load(axle[0].name, mean, load)
            for axle, mean, load, empty in zip(own.signals, own.means, own.loads, own.empty, strict=True)
            if empty
        )
        return [_error(own, "weight", text, 100 * (own.means.sum() / own.loads.sum() - 1), "%")]
    wheels = np.array([p.m1, p.m2]) * p.g
    missing = own.loads - own.means
    if _near(missing, wheels, own.loads) and not _near(missing, 0 * wheels, own.loads):
        return [
            _error(
                own,
                "weight",
                f"The wheel forces lack {missing[0]:.4g} N in front and {missing[1]:.4g} N at "
                f"the rear on average, the weight of the wheels ({wheels[0]:.4g} N and {wheels[1]:.4g} N): they "
                "were measured above the wheels. Add it, with the wheels' inertia force if they move.",
                100 * (own.means.sum() / own.loads.sum() - 1),
                "%",
            )
        ]
    if _near(own.means, own.loads / 2, own.loads / 2):
        return [
            _error(
                own,
                "weight",
                f"The wheel forces are half the static loads of the axles ({own.loads[0]:.5g} N "
                f"and {own.loads[1]:.5g} N): they are of one wheel of each axle. Add those of the other.",
                -50.0,
                "%",
            )
        ]
    return _exchanged(own)


def _near(values: np.ndarray, wanted: np.ndarray, scale: np.ndarray) -> bool:
    return bool((np.abs(values - wanted) < LIKE * scale / 2).all())


def _exchanged(own: AxleForces) -> list[Finding]:
    """Axles whose loads fit crosswise, and not as they are named."""
    as_is, crossed = (np.abs(each / own.loads - 1).max() for each in (own.means, own.means[::-1]))
    if crossed > LIKE or as_is < 3 * crossed or not steady(own).seen[1]:
        return []
    text = (
        f"Front and rear are exchanged: {own.means[0]:.5g} N in front and {own.means[1]:.5g} N at the rear on "
        f"average, where {own.loads[0]:.5g} N and {own.loads[1]:.5g} N rest. Exchange their columns, or a and b of "
        "the vehicle."
    )
    return [_error(own, "swapped", text, 100 * float(as_is), "%")]


def _coarse(own: AxleForces) -> list[Finding]:
    """Axles whose mean says by itself that sign or unit is wrong, or that moves the vehicle beyond all roads."""
    found, far = [], _far(own, steady(own)).any()
    for axle, mean, load in zip(own.signals, own.means, own.loads if own.parameters.g else (), strict=False):
        for_axle = f"the {load:.5g} N that rest on it on average"
        kind, text = sentence(float(mean / load), axle[0], for_axle, own.remedies)
        if kind in ("sign", "unit") or (kind == "size" and far):
            found.append(
                Finding(
                    "weight" if kind == "size" else kind,
                    "error",
                    axle[0].at,
                    text,
                    float(mean / load),
                    "1",
                    tuple(s.name for s in axle),
                )
            )
    return found


def _balance(own: AxleForces) -> list[Finding]:
    """Accelerations that a vehicle cannot keep up: its fall, and its turn."""
    found = steady(own)
    if not found.seen.any():
        return []
    beyond = np.abs(found.shares) > LARGE + found.known / found.units
    weight: Weight = "error" if (beyond & _far(own, found)).any() else "doubt"
    excess = np.linalg.solve(own.arms, np.where(found.seen, found.accelerations, 0.0))
    share = excess / own.loads
    told = " and ".join(
        _excess(*each)
        for each in zip(("the front axle", "the rear axle"), excess, share, strict=True)
        if abs(each[2]) > SMALL / 2
    )
    text = (
        f"On average {told} against what rests there: {_motion(own, found)}. Check calibration, zero and the "
        "vehicle's masses and a, b; a vehicle that brakes or accelerates has forces along the road, too, which "
        "this model has not."
    )
    kind = "balance" if found.seen[1] else "weight"
    size = float(found.shares[1] if found.seen[1] else found.shares[0])
    return [Finding(kind, weight, "wheel forces", text, 100 * size, "%", own.names)]


def _far(own: AxleForces, found: Steady) -> np.ndarray:
    """Which steady acceleration (2,) moves the vehicle further in the run than a road does."""
    return found.seen & (np.abs(found.accelerations) * own.duration**2 / 2 > [HEIGHT, STEEP])


def _excess(name: str, excess: float, share: float) -> str:
    return f"{name} carries {abs(excess):.4g} N ({abs(share):.2%}) too {'much' if excess > 0 else 'little'}"


def _motion(own: AxleForces, found: Steady) -> str:
    """Where the steady accelerations take the vehicle in the run."""
    risen, turned = found.accelerations * own.duration**2 / 2
    parts = [f"{'rises' if risen > 0 else 'falls'} {abs(risen):.3g} m"] if found.seen[0] else []
    parts += [f"turns {abs(turned):.3g} rad nose {'up' if turned > 0 else 'down'}"] if found.seen[1] else []
    return f"a vehicle free to move {' and '.join(parts)} in {own.duration:g} s"


def _start(own: AxleForces) -> list[Finding]:
    """Forces that begin in the middle of a motion, while the run begins at rest."""
    first = own.forces[0] / own.loads - 1
    last = own.pitch[1][min(len(own.forces) - 1, round(own.duration / own.period))]
    if not own.rests or own.parameters.g == 0 or np.abs(first).max() < OFF or abs(last) < max(STEEP, _noise(own)):
        return []
    text = (
        f"The run begins at rest, and the wheel forces {first[0]:+.1%} in front and {first[1]:+.1%} at the rear "
        "off the static loads: they begin in the middle of a motion, or are not of this vehicle, and turn it by "
        f"{last:+.3g} rad in {own.duration:g} s. Begin where the vehicle stands or drives on a smooth road, or "
        "give its state under [start]."
    )
    return [Finding("start", "doubt", "wheel forces", text, float(last), "rad", own.names)]


def _noise(own: AxleForces) -> float:
    """Four standard deviations (rad) of the pitch that white noise of the samples makes by the end of the run.

    The noise is at most what the third differences of the forces have: a smooth signal has less of them.
    """
    rough = float(np.diff(own.forces, 3, axis=0).std()) / 20**0.5
    return 4 * (own.rigid.intensity(rough, own.period) * own.duration**3 / 3) ** 0.5


def _dead(own: AxleForces) -> list[Finding]:
    """An axle that never changes, beside one that does."""
    still = np.ptp(own.forces, axis=0) == 0
    if still.all() or not still.any():
        return []
    axle = own.signals[int(still.argmax())][0]
    text = f"{axle.name} never changes while the other axle's force does: a dead channel, or one that was filled up."
    return [Finding("balance", "doubt", axle.at, text, 0.0, "N", (axle.name,))]


def _copied(own: AxleForces) -> list[Finding]:
    """An axle that has the other one's samples, times a factor."""
    off = own.forces - own.means
    size = np.sqrt(np.mean(off**2, axis=0))
    if not size.all() or np.sqrt(np.mean((off[:, 1] / size[1] - off[:, 0] / size[0]) ** 2)) > COPIED:
        return []
    text = (
        f"The rear axle's force changes as the front axle's does, times {size[1] / size[0]:.4g}, in every sample: one "
        "channel was written twice, unless both axles were moved alike."
    )
    return [Finding("copied", "doubt", "wheel forces", text, float(size[1] / size[0]), "1", own.names)]


def _order(own: AxleForces) -> list[Finding]:
    """Axles that feel the road in the wrong order."""
    late, alike, other = _delay(own)
    if alike < ALIKE or late > 0 or alike < 1.5 * other:
        return []
    text = (
        f"The rear axle feels the road {-late:.3g} s before the front axle (correlation {alike:.2f}): front and "
        "rear are exchanged, or time runs backwards, unless the vehicle drove so."
    )
    return [Finding("swapped", "doubt", "wheel forces", text, late, "s", own.names)]


def _delay(own: AxleForces) -> tuple[float, float, float]:
    """Time (s) by which the rear axle repeats the front one, their correlation then, and the best with the other
    sign; 0 where nothing can be said."""
    n = len(own.forces)
    frequencies = np.fft.rfftfreq(2 * n, own.period)
    band = (frequencies > BAND[0]) & (frequencies < BAND[1])
    spectra = np.fft.rfft(own.forces - own.means, 2 * n, axis=0) * band[:, None]
    power = np.sqrt(np.prod((np.abs(spectra) ** 2).sum(axis=0)))
    low, high = (round(lag / own.period) for lag in LAG)
    if not power > 0 or n < 2 * high:
        return 0.0, 0.0, 0.0
    alike = np.fft.irfft(spectra[:, 0].conj() * spectra[:, 1]) * n / power
    after, before = alike[low : high + 1], alike[-high : -low + 1 or None][::-1]
    best = before if before.max() > after.max() else after
    sign = -1 if best is before else 1
    other = after if best is before else before
    return sign * (low + int(best.argmax())) * own.period, float(best.max()), float(other.max())


def unchecked(own: AxleForces) -> str:
    """What these forces alone do not show of the time from axle to axle, and what would; "" of constant forces."""
    if not np.ptp(own.forces, axis=0).any():
        return ""
    late, alike, _ = _delay(own)
    seen = ""
    if late > 0 and alike >= ALIKE:
        speed = (own.parameters.a + own.parameters.b) / late
        seen = f" (the rear repeats the front {late:.3g} s later, which is right for about {speed:.2g} m/s)"
    tells = "the driven speed tells, or a measured pitch (effect kalman_filter)"
    return f"not checked: whether an axle is late{seen}; {tells}"


def _good(own: AxleForces) -> Finding:
    found = steady(own)
    text = (
        f"The mean wheel forces carry the vehicle to {found.shares[0]:+.2%} of its weight; an error of "
        f"{100 * found.known[0] / GRAVITY:.2g} % would be seen, of one axle of "
        f"{100 * abs(found.known[1] / (own.arms[1] * own.loads)).max():.2g} %."
    )
    return Finding("weight", "note", "", text, 100 * float(found.shares[0]), "%", own.names)


def _error(own: AxleForces, kind: str, text: str, size: float, unit: str) -> Finding:
    return Finding(kind, "error", "wheel forces", text, float(size), unit, own.names)
