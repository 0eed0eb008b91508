"""An integrator from outside."""

from scipy.integrate import solve_ivp


class Scipy:
    """An outside engine: scipy's DOP853 at the requested tolerance."""

    order, adaptive = 8, True

    def integrate(self, f, times, start, tolerance):
        """States (n, 8) at the times (s)."""
        ends = times[[0, -1]]
        return solve_ivp(f, ends, start, "DOP853", times, rtol=tolerance, atol=tolerance, max_step=0.01).y.T
