"""The oracle's smooth Beckmann and GGX BRDF against Mitsuba 3, which shares nothing with it.

Run on demand from the root of the tree; no other test needs it:

    python3 -m venv mitsuba-venv && mitsuba-venv/bin/pip install mitsuba numpy
    mitsuba-venv/bin/python tests/cross_check/smooth_brdf_mitsuba.py

Evaluates `roughconductor` (no Fresnel reflectance, both distributions, alpha .1, .3, .5) for the directions that
`cargo run -p mica-oracle --example smooth_brdf` prints, and compares. Mitsuba computes in 32 bits, has Beckmann's masking
by the rational fit of Walter et al. 2007 and drops what is below 1e-20. Exit code 0 if all agree.

Measured with Mitsuba 3.9.1, 4200 pairs of directions, 3560 of them above 1e-12/sr: 1.0e-5 apart at most for Beckmann by
the same fit and 4.2e-6 for GGX; 5.8e-3 for Beckmann by the exact masking, which is the fit's error. A bias of .1 % fails.
"""

import subprocess
import sys

import mitsuba as mi
import numpy as np

TOLERANCE = 5e-5  # Relative, where the BRDF is above LEAST: f32 near grazing directions and far out in the lobe.
LEAST = 1e-12  # 1/sr; below it, only that the other is small too.
FIT = 6.5e-3  # Two factors of the rational fit, each within .32 % of the exact masking.


def oracle_rows():
    command = ["cargo", "run", "--quiet", "--package", "mica-oracle", "--example", "smooth_brdf"]
    lines = subprocess.run(command, check=True, capture_output=True, text=True).stdout.splitlines()
    rows = {}
    for line in lines[1:]:
        name, alpha, *numbers = line.split()
        rows.setdefault((name, float(alpha)), []).append([float(number) for number in numbers])
    return {key: np.array(values) for key, values in rows.items()}


def mitsuba_brdf(name, alpha, rows):
    """BRDF in 1/sr: `eval` multiplies it by the cosine of the outgoing direction, which is the light's here."""
    bsdf = mi.load_dict({"type": "roughconductor", "material": "none", "distribution": name, "alpha": alpha})
    context, surface = mi.BSDFContext(), mi.SurfaceInteraction3f()
    surface.n = surface.sh_frame.n = mi.Vector3f(0, 0, 1)
    values = []
    for row in rows:
        surface.wi = mi.Vector3f(*row[3:6])
        values.append(bsdf.eval(context, surface, mi.Vector3f(*row[0:3]))[0] / row[2])
    return np.array(values)


def worst(found, expected):
    above = expected > LEAST
    return np.max(np.abs(found[above] / expected[above] - 1.0)), int(np.sum(above))


def main():
    mi.set_variant("scalar_rgb")
    agree = True
    for (name, alpha), rows in oracle_rows().items():
        found, exact, rational = mitsuba_brdf(name, alpha, rows), rows[:, 6], rows[:, 7]
        by_fit, compared = worst(found, rational)
        by_integral, _ = worst(found, exact)
        below = np.max(found[rational <= LEAST], initial=0.0)
        biased, _ = worst(1.001 * found, rational)
        print(
            f"{name} alpha {alpha}: {len(rows)} pairs, {compared} above {LEAST:g}: {by_fit:.1e} off at most by the "
            f"same fit, {by_integral:.1e} by the exact masking; elsewhere at most {below:.1e}"
        )
        agree &= by_fit < TOLERANCE and by_integral < FIT and below < 2 * LEAST
        if biased < TOLERANCE:
            print("a bias of .1 % does not show")
            agree = False
    print("all agree" if agree else "they do not agree")
    return 0 if agree else 1


if __name__ == "__main__":
    sys.exit(main())
