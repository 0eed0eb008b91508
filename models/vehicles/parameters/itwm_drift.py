"""Parameters of the published pitch-plane vehicle: symmetric about its centre of mass, which hides a swap of a and
b."""

from models.vehicles.pitch_plane import PitchPlaneParameters

SOURCE = "drift from noisy wheel forces (Fraunhofer ITWM), Appendix B"
PARAMETERS = PitchPlaneParameters(
    a=1.0, b=1.0, m1=15.0, m2=15.0, m3=750.0, I=500.0, k1=2e5, k2=2e5, k3=1e5, k4=1e5, d1=2e2, d2=2e2, d3=1e4, d4=1e4
)
