"""A rubber sleeve with straight fibres between rings: its shape, its volume, its force and its rubber. Compiled.

Fibres along the sleeve do not stretch, so that from ring to ring each is an arc of fixed length (Nakamura, Saga and
Yaegashi 2003, straight-fibre muscles). With the half angle t of that arc a sleeve is shorter by 1 - sin(t) / t. Its
volume is that of the arc turned about the axis, its pull what that volume gains per length given up. Rubber between
the fibres is stretched along the hoop alone (pure shear, energy C (stretch - 1 / stretch)^2, Rivlin 1948), and a part
of it flows by a power of its own stress (Bergstrom and Boyce 1998).
"""

import math

from hil.reference.compiling import compiled

LEAST_T, MOST_T = 0.25, 2.0
"""Half angle (rad) below which fibres would have to stretch, and beyond which folds touch."""
GAUSS_AT = (0.112701665379258, 0.5, 0.887298334620742)
GAUSS_WEIGHT = (5.0 / 18.0, 8.0 / 18.0, 5.0 / 18.0)
FLOW_STRAIN, FLOW_POWER, FLOW_S = 0.1, 3.0, 1.0
MEAN_SQUARE = 8.0 / 15.0
"""Mean square of a parabola against its top's."""


@compiled
def opened(contraction: float, t: float, turns: int) -> float:
    """Half angle (rad) at a contraction, by so many of Newton's steps from a guess `t`; between LEAST_T and MOST_T."""
    for _ in range(turns):
        t -= (1.0 - contraction - math.sin(t) / t) * t * t / (math.sin(t) - t * math.cos(t))
        t = max(LEAST_T, min(MOST_T, t))
    return t


@compiled
def length_slope(t: float) -> float:
    """By how much of a fibre's length its ends come nearer per half angle (1 / rad)."""
    return (math.sin(t) - t * math.cos(t)) / (t * t)


@compiled
def middle_bulge(t: float, ring_m: float) -> tuple[float, float]:
    """(by how much the middle of an arc stands out in m, its slope by t)."""
    sine, fall = math.sin(t), 1.0 - math.cos(t)
    return 0.5 * ring_m * fall / t, 0.5 * ring_m * (t * sine - fall) / (t * t)


@compiled
def arc_volume(t: float, radius_m: float, ring_m: float) -> float:
    """Volume (m^3) from ring to ring: a cylinder, the segment of the arc at the cylinder's radius, and its own turn."""
    sine, cosine, arc_m = math.sin(t), math.cos(t), 0.5 * ring_m / t
    cylinder = math.pi * radius_m * radius_m * ring_m * sine / t
    segment = 2.0 * math.pi * radius_m * arc_m * arc_m * (t - sine * cosine)
    return cylinder + segment + 2.0 * math.pi * arc_m**3 * (sine - sine**3 / 3.0 - t * cosine)


@compiled
def pull_area(t: float, radius_m: float, ring_m: float) -> float:
    """Force per pressure (m^2): what the volume gains per length given up; below zero a sleeve would push."""
    sine, cosine = math.sin(t), math.cos(t)
    turned = sine - sine**3 / 3.0 - t * cosine
    own = 0.25 * ring_m * ring_m * (t * (t * sine - sine * sine * cosine) - 3.0 * turned)
    own /= t * t * (sine - t * cosine)
    return math.pi * (own + radius_m * ring_m * cosine / t - radius_m * radius_m)


@compiled
def rubber_force(t: float, radius_m: float, ring_m: float, modulus_n_m: float) -> float:
    """Force (N) by which the hoop's stretch pushes a sleeve longer: its energy along the arc, by Gauss's points."""
    half, total = 0.5 * ring_m / (radius_m * t), 0.0
    fall, sine = math.cos(t), math.sin(t)
    for k in range(3):
        u = GAUSS_AT[k]
        out = half * (math.cos(u * t) - fall)
        rise = half * (sine - u * math.sin(u * t)) - out / t
        stretch = 1.0 + out
        total += GAUSS_WEIGHT[k] * 2.0 * (stretch - 1.0 / stretch) * (1.0 + 1.0 / (stretch * stretch)) * rise
    return 2.0 * math.pi * radius_m * modulus_n_m * total / length_slope(t)


@compiled
def flowing_force(t: float, flowed: float, radius_m: float, ring_m: float, modulus_n_m: float) -> float:
    """Force (N) of the rubber that flows: an elastic hoop whose rest is the strain `flowed`."""
    out, slope = middle_bulge(t, ring_m)
    strain = out / radius_m - flowed
    energy_slope = 2.0 * math.pi * radius_m * modulus_n_m * 8.0 * MEAN_SQUARE * strain * slope / radius_m
    return energy_slope / length_slope(t)


@compiled
def flow_rate(strain: float) -> float:
    """Rate (1/s) at which rubber flows under what is left of its strain."""
    size = min(4.0, abs(strain) / FLOW_STRAIN)
    return math.copysign(FLOW_STRAIN / FLOW_S * size**FLOW_POWER, strain)
