"""Section forces of the suspension in the chassis' own frame: what a component of the chassis feels.

Both components count. The vertical force alone cannot see a tumbling vehicle: f3 = f1 - m1 g + m1 z1'' holds
at every pitch, while its component along the chassis is f3 sin(pitch).
"""

import numpy as np

CHANNELS = ("f3x", "f3z", "f4x", "f4z")
"""Front and rear, along the chassis' forward axis and (in compression) along its vertical one."""


def section_forces(f3: np.ndarray, f4: np.ndarray, pitch: np.ndarray) -> dict[str, np.ndarray]:
    """Body-frame components (N) of the vertical suspension forces f3, f4 (N, compression positive), shape (n,) each.

    pitch in rad, nose up. ``f3x`` is positive forward: with the nose up, an upward force points forward along the
    chassis. ``f3z`` is positive in compression, that is up along the chassis' own vertical.
    """
    sine, cosine = np.sin(pitch), np.cos(pitch)
    return {"f3x": f3 * sine, "f3z": f3 * cosine, "f4x": f4 * sine, "f4z": f4 * cosine}
