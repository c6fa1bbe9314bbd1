"""Results as a measurement would leave them, made from statics alone: no solver, fit or camera of the project is used.

A cable with the law m = b D + (a - b) c tanh(D / c), D = K - K0, hangs in moment-free ends: K = theta', m = P y. The
shape follows from integrating that from mid-span, the force from y(L/2) = 0. Photos are drawn with Pillow.
"""

from __future__ import annotations

import base64
import functools
import io

import numpy as np
from PIL import Image, ImageDraw, ImageFilter
from scipy.integrate import cumulative_trapezoid, solve_ivp
from scipy.optimize import brentq

from pipeline.result import (
    AgreementPart,
    BalancePart,
    Curve,
    FindingPart,
    InversePart,
    KnotPart,
    MisfitPart,
    PhotoPart,
    PointwisePart,
    PreviewPart,
    Result,
    ScalePart,
    SpecimenPart,
    StepPart,
)

LENGTH, DIAMETER, K0 = 0.2, 0.006, 2.0
STIFF, SOFT, BEND = 20e-3, 8e-3, 3.0
PX_PER_M = 9500.0
REDUCTION = 2.4
STEPS = ((0, "mounted", 2.001), (1, "loading", 5.0), (2, "loading", 7.0), (3, "loading", 8.7))
STEPS += ((4, "unloading", 7.0), (5, "unloading", 5.0), (6, "unloading", 3.0))


def tangent_of(kappa):
    return SOFT + (STIFF - SOFT) / np.cosh((kappa - K0) / BEND) ** 2


def moment_of(kappa):
    excess = kappa - K0
    return SOFT * excess + (STIFF - SOFT) * BEND * np.tanh(excess / BEND)


def equilibrium(kappa_max):
    """Force, and s, x, y, theta, kappa of the left half mirrored to the whole, from mid-span outwards."""
    grid = np.linspace(K0 - 1.0, kappa_max + 1.0, 2000)
    moment = moment_of(np.array([kappa_max]))[0]

    def half(force):
        def slope(_, state):
            theta, y = state
            return [-np.interp(force * y, moment_of(grid), grid), np.sin(theta)]

        return solve_ivp(
            slope,
            (0.0, LENGTH / 2),
            [0.0, moment / force],
            t_eval=np.linspace(0, LENGTH / 2, 101),
            rtol=1e-7,
            atol=1e-9,
        ).y

    force = brentq(lambda p: half(p)[1][-1], 1e-4, 10.0, xtol=1e-9)
    theta_half, y_half = half(force)
    theta = np.concatenate([-theta_half[::-1], theta_half[1:]])
    y = np.concatenate([y_half[::-1], y_half[1:]])
    s = np.linspace(0.0, LENGTH, theta.size)
    x = cumulative_trapezoid(np.cos(theta), s, initial=0.0)
    return force, s, x, y, -theta, np.interp(force * y, moment_of(grid), grid)


def photograph(u, v, rng):
    """JPEG of a dark cable on a bright table, and the straightened strip."""
    width, height = 2448, 1000
    size = (round(width / REDUCTION), round(height / REDUCTION))
    picture = Image.new("L", size, 205)
    pen = ImageDraw.Draw(picture)
    points = list(zip(u / REDUCTION, v / REDUCTION, strict=True))
    pen.line(points, fill=45, width=round(DIAMETER * PX_PER_M / REDUCTION), joint="curve")
    for x, y in (points[0], points[-1]):
        pen.ellipse([x - 24, y - 24, x + 24, y + 24], fill=120)
        pen.ellipse([x - 4, y - 4, x + 4, y + 4], fill=15)
    picture = picture.filter(ImageFilter.GaussianBlur(0.8))
    grain = rng.normal(0.0, 3.0, (size[1], size[0]))
    picture = Image.fromarray(np.clip(np.asarray(picture) + grain, 0, 255).astype(np.uint8))
    band = np.clip(205 - 160 * (np.abs(np.arange(60) - 30) < 18)[:, None] + rng.normal(0, 3, (60, 900)), 0, 255)
    return size, jpeg(picture), jpeg(Image.fromarray(band.astype(np.uint8)))


def jpeg(picture):
    data = io.BytesIO()
    picture.save(data, "JPEG", quality=80)
    return base64.b64encode(data.getvalue()).decode("ascii")


def traced(step, kappa_max, rng):
    """One photo and its force: curvature with correlated errors of the size it claims."""
    force, s, x, y, theta, kappa = equilibrium(kappa_max) if step else (0.0, *arc())
    seen = (s > 0.007) & (s < LENGTH - 0.007)
    std = np.where(seen, 0.02, 0.08)
    wave = np.cos(np.outer(s / LENGTH, np.arange(1, 7)) * np.pi) @ rng.normal(size=6) / np.sqrt(3.0)
    residual = 1.2e-5 * np.cos(np.outer(s / LENGTH, np.arange(1, 9)) * np.pi) @ rng.normal(size=8) / 2.0
    u, v = 350.0 + PX_PER_M * x, 160.0 + PX_PER_M * y
    size, picture, strip = photograph(u, v, rng)
    return force, PhotoPart(
        image=f"images/step_{step:02d}.png",
        step=step,
        status="traced",
        chord_m=float(x[-1]),
        chord_std_m=1e-5,
        traced_length_m=LENGTH + 2e-5,
        traced_length_std_m=3e-5,
        width_m=DIAMETER,
        width_std_m=4e-5,
        left_px=(float(u[0]), float(v[0])),
        right_px=(float(u[-1]), float(v[-1])),
        mirrored=False,
        s_m=s.tolist(),
        x_m=x.tolist(),
        y_m=y.tolist(),
        u_px=u.tolist(),
        v_px=v.tolist(),
        theta_rad=theta.tolist(),
        kappa_per_m=(kappa + std * wave).tolist(),
        kappa_std_per_m=std.tolist(),
        seen=seen.tolist(),
        kappa_fit_per_m=kappa.tolist(),
        shape_residual_m=residual.tolist(),
        shape_residual_std_m=np.full(s.size, 1.2e-5).tolist(),
        preview=PreviewPart(
            jpeg_base64=picture, width=size[0], height=size[1], reduction=REDUCTION, strip_base64=strip
        ),
    )


def arc():
    """The cable at rest: a circular arc of curvature K0."""
    s = np.linspace(0.0, LENGTH, 201)
    theta = K0 * (LENGTH / 2 - s)
    x = (np.sin(K0 * LENGTH / 2) - np.sin(theta)) / K0
    return s, x, (np.cos(theta) - np.cos(K0 * LENGTH / 2)) / K0, -theta, np.full(s.size, K0)


def curve_of(relative_std, bias=0.0, top=8.7, with_factor=True):
    kappa = np.linspace(K0, top, 61)
    tangent, moment = tangent_of(kappa) * (1.0 + bias), moment_of(kappa) * (1.0 + bias)
    share = (kappa - K0) / (top - K0)
    factor = np.column_stack([tangent * relative_std * (1 - share), tangent * relative_std * (0.5 + 2 * share**2)])
    std = np.hypot(*factor.T)
    secant = np.divide(moment, kappa - K0, out=tangent.copy(), where=kappa > K0)
    return Curve(
        kappa_per_m=kappa.tolist(),
        moment_Nm=moment.tolist(),
        moment_std_Nm=(relative_std * moment + 1e-6).tolist(),
        tangent_Nm2=tangent.tolist(),
        tangent_std_Nm2=std.tolist(),
        secant_Nm2=secant.tolist(),
        secant_std_Nm2=(relative_std * secant).tolist(),
        supported=[True] * kappa.size,
        tangent_factor_Nm2=factor.tolist() if with_factor else [],
    )


def ways(rng):
    """Both ways and their agreement."""
    curve = curve_of(0.006)
    knots = [KnotPart(kappa_per_m=k, tangent_Nm2=float(tangent_of(k)), std_Nm2=2e-4) for k in (2.0, 4.2, 6.4, 8.7)]
    misfit = MisfitPart(
        force_rmse_N=0.0021,
        shape_rmse_m=1.3e-5,
        chi2=812.0,
        degrees_of_freedom=790.0,
    )
    inverse = InversePart(
        outcome="converged",
        converged=True,
        pre_curvature_per_m=2.004,
        pre_curvature_std_per_m=0.013,
        supported_per_m=(2.0, 8.7),
        knots=knots,
        curve=curve,
        misfit=misfit,
        nuisance={"scale": (1.0002, 0.0004)},
    )
    points = np.sort(rng.uniform(K0, 8.7, 300))
    balance = BalancePart(
        outcome="measured",
        pre_curvature_per_m=1.99,
        pre_curvature_std_per_m=0.04,
        supported_per_m=(2.0, 8.6),
        curve=curve_of(0.018, bias=0.008, top=8.6),
        points_kappa_per_m=points.tolist(),
        points_moment_Nm=(moment_of(points) * (1 + 0.004 * rng.normal(size=points.size))).tolist(),
        pointwise=[
            PointwisePart(
                step=step,
                kappa_per_m=np.linspace(2.4, top, 40).tolist(),
                tangent_Nm2=(tangent_of(np.linspace(2.4, top, 40)) * (1 + 0.1 * rng.normal(size=40))).tolist(),
            )
            for step, _, top in STEPS[1:4]
        ],
        checks={"left_against_right_p": 0.44},
    )
    agreement = AgreementPart(
        rms_relative=0.009,
        max_relative=0.021,
        compatible=True,
        p_value=0.43,
        range_per_m=(2.0, 8.6),
        pre_curvature={"photo": (2.001, 0.006), "balance": (1.99, 0.04), "inverse": (2.004, 0.013)},
    )
    return inverse, balance, agreement


@functools.cache
def measured_result():
    """Seven photos, loading and unloading, both ways, nothing wrong with the model: no diagnosis yet."""
    rng = np.random.default_rng(7)
    photos, steps = [], []
    for step, branch, kappa_max in STEPS:
        force, photo = traced(step, kappa_max, rng)
        photos.append(photo)
        steps.append(
            StepPart(
                step=step,
                branch=branch,
                displacement_m=photos[0].chord_m - photo.chord_m,
                force_N=force + 0.003 * rng.normal(),
                force_std_N=0.003,
                force_fit_N=force,
                image=photo.image,
            )
        )
    inverse, balance, agreement = ways(rng)
    return Result(
        status="measured",
        headline="Measured.",
        specimen=SpecimenPart(
            id="cable-07",
            length_m=LENGTH,
            diameter_m=DIAMETER,
            folder="batch/cable-07",
            moving_bearing="left",
            description={"type": "HV 35 mm²", "batch": "2026-11", "notes": "taken from the spool"},
        ),
        scale=ScalePart(
            px_per_mm=9.5, std_relative=0.0004, source="scale_px_per_mm of specimen.toml", axis_parallax_std=0.0041
        ),
        photos=photos,
        steps=steps,
        inverse=inverse,
        balance=balance,
        agreement=agreement,
        findings=[FindingPart(code="camera/scale", level="info", message="The scale is the one given, 9.5 px/mm.")],
        provenance={
            "program": "cablebend",
            "version": "0.1.0",
            "python": "3.11.2",
            "libraries": {"numpy": "2.4.6", "scipy": "1.17.1"},
            "command": "cablebend run batch -o results",
            "clock": {"created_utc": "2026-11-21T08:00:00+00:00"},
            "inputs_sha256": {"force.csv": "ab" * 32, "images/step_00.png": "cd" * 32},
            "settings": {"report": {"language": "en"}},
        },
    )
