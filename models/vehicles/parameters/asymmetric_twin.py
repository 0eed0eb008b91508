"""Parameters of a twin of the published pitch-plane vehicle without its symmetry: every front value differs from its
rear one."""

from models.vehicles.pitch_plane import PitchPlaneParameters

SOURCE = "chosen for twinrig: the published set with each pair of equal values pulled apart"
PARAMETERS = PitchPlaneParameters(
    a=1.3,
    b=0.8,
    m1=14.0,
    m2=18.0,
    m3=720.0,
    I=540.0,
    k1=1.9e5,
    k2=2.3e5,
    k3=0.9e5,
    k4=1.2e5,
    d1=1.8e2,
    d2=2.6e2,
    d3=0.9e4,
    d4=1.2e4,
)
