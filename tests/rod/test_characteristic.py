"""The moment curve: readings as worked out in the physics notes, derivatives against central differences, edges."""

import numpy as np
import pytest
from scipy.integrate import quad

from rod.characteristic import Characteristic
from rod.laws import StickSlip

KNOTS, ORDINATES = [0.0, 5.0, 10.0], [5e-3, 3e-3, 2e-3]  # Table 1
KINDS = [(reading, abscissa) for reading in ("tangent", "secant") for abscissa in ("curvature", "excess")]


def table_1(reading: str, abscissa: str = "curvature") -> Characteristic:
    return Characteristic.from_ordinates(KNOTS, ORDINATES, reading=reading, abscissa=abscissa)


def test_readings_of_table_1() -> None:
    # Columns: kappa, f, tangent if f is a secant, secant if f is a tangent; K0 = 2, in mN m^2, printed to 3 digits.
    for kappa, f, tangent, secant in [
        (3.0, 3.704, 3.308, 3.907),
        (5.0, 3.000, 2.100, 3.526),
        (8.0, 2.316, 1.272, 3.076),
        (10.0, 2.000, 0.800, 2.846),
    ]:
        # half the last printed digit
        assert 1e3 * table_1("secant").f(kappa) == pytest.approx(f, abs=5.1e-4)
        assert 1e3 * table_1("secant").tangent(kappa, 2.0) == pytest.approx(tangent, abs=5.1e-4)
        assert 1e3 * table_1("tangent").secant(kappa, 2.0) == pytest.approx(secant, abs=5.1e-4)


def test_limit_point_of_the_secant_reading() -> None:
    for K0, limit in [(2.0, 12.67), (0.0, 11.67)]:
        law = table_1("secant")
        assert law.tangent(limit - 0.01, K0) > 0.0 > law.tangent(limit + 0.01, K0)


@pytest.mark.parametrize(("reading", "abscissa"), KINDS)
def test_every_function_is_the_derivative_of_the_next(reading: str, abscissa: str) -> None:
    law = table_1(reading, abscissa)
    K, K0, step = np.linspace(-3.3, 14.1, 59), np.linspace(1.0, 2.5, 59), 1e-5
    size = 5e-3

    def slope(function, by_rest: bool = False) -> np.ndarray:
        shift = (0.0, step) if by_rest else (step, 0.0)
        return (function(K + shift[0], K0 + shift[1]) - function(K - shift[0], K0 - shift[1])) / (2.0 * step)

    assert np.allclose(slope(law.moment), law.tangent(K, K0), atol=1e-7 * size)
    assert np.allclose(slope(law.moment, by_rest=True), law.moment_by_pre_curvature(K, K0), atol=1e-7 * size)
    assert np.allclose(law.moment_by_parameters(K, K0) @ law.ordinates, law.moment(K, K0), atol=1e-12 * size)
    assert np.allclose(law.secant(K, K0) * (K - K0), law.moment(K, K0), atol=1e-12 * size)
    assert np.allclose(law.moment(K0, K0), 0.0, atol=1e-15)
    for bound, direct in zip(law.bound(K0)(K), (law.moment(K, K0), law.tangent(K, K0)), strict=True):
        assert np.allclose(bound, direct, rtol=1e-12, atol=1e-14 * size)


def test_moment_is_the_integral_of_the_tangent_reading() -> None:
    law = table_1("tangent")
    integral, _ = quad(lambda k: float(law.f(k)), 2.0, 9.0, points=[5.0], epsabs=1e-14)
    assert law.moment(9.0, 2.0) == pytest.approx(integral, rel=1e-12)


def test_secant_at_rest_is_the_limit_without_loss_of_digits() -> None:
    law, K0 = table_1("tangent"), 2.0
    excess = np.logspace(-14, -1, 40)
    series = law.f(K0) + 0.5 * excess * (law.f(K0 + 1e-4) - law.f(K0 - 1e-4)) / 2e-4
    assert np.allclose(law.secant(K0 + excess, K0), series, rtol=1e-5)
    assert law.secant(K0, K0) == pytest.approx(float(law.f(K0)), rel=1e-14)


def test_linear_continuation_outside_the_knots() -> None:
    f = table_1("tangent").f
    for end, outward in [(0.0, -1.0), (10.0, 1.0)]:
        rise = f(end + outward) - f(end)
        assert f(end + 2.0 * outward) - f(end + outward) == pytest.approx(float(rise), rel=1e-12)
        inside = (f(end) - f(end - 1e-4 * outward)) / 1e-4
        assert inside == pytest.approx(float(rise), rel=1e-3)  # the slope goes on


def test_constant_stiffness_has_one_reading() -> None:
    law = Characteristic.constant(4e-3)
    assert law.moment(7.0, 2.0) == pytest.approx(0.02, rel=1e-14)
    assert law.tangent(7.0, 2.0) == law.secant(7.0, 2.0) == 4e-3


def test_law_function_is_met_at_the_knots() -> None:
    law = StickSlip(6e-3, 2e-3, 4.0)
    knots = np.linspace(0.0, 12.0, 40)
    spline = Characteristic.from_ordinates(knots, law.tangent(knots, 0.0), abscissa="excess")
    K = np.linspace(2.0, 13.0, 200)
    assert np.allclose(spline.tangent(K, 2.0), law.tangent(K, 2.0), rtol=2e-3)  # natural end at the peak of f
    assert np.allclose(spline.moment(K, 2.0), law.moment(K, 2.0), rtol=1e-3)


def test_stick_slip_law_is_consistent() -> None:
    law, K, step = StickSlip(6e-3, 2e-3, 4.0), np.linspace(-15.0, 20.0, 71), 1e-5
    by_moment = (law.moment(K + step, 2.0) - law.moment(K - step, 2.0)) / (2.0 * step)
    assert np.allclose(by_moment, law.tangent(K, 2.0), rtol=1e-7)
    assert law.moment(900.0, 2.0) == pytest.approx(2e-3 * 898.0 + 4e-3 * 4.0, rel=1e-12)  # no overflow far out


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (((0.0, 5.0, 5.0), (1.0, 1.0, 1.0)), "increase"),
        (((0.0, 5.0), (1.0, 1.0, 1.0)), "equal"),
        (((0.0, np.nan), (1.0, 1.0)), "finite"),
    ],
)
def test_nonsense_is_refused(arguments: tuple[object, object], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        Characteristic.from_ordinates(*arguments)
