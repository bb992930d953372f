"""Wave spectra: one-sided spectral densities S(w) of the elevation (m2 s) over the angular frequency w (rad/s).

The area under a spectrum is m0, the variance of the elevation; the significant height is Hs = 4 sqrt(m0). The peak of S is at
wp = 2 pi / Tp.

    Pierson-Moskowitz   S = 5/16 Hs^2 wp^4 / w^5 exp(-5/4 (wp / w)^4)
    JONSWAP             S = (1 - 0.287 ln gamma) S_PM gamma^exp(-((w - wp) / (s wp))^2 / 2), s = 0.07 up to wp, 0.09 above

The first is the ITTC-modified form (A = 487 Hs^2 / Tp^4, B = 1949 / Tp^4 there, from 5/16 (2 pi)^4 and 5/4 (2 pi)^4), the second
is that of DNV-RP-C205 (2021), 3.5.5, whose normalising factor preserves Hs within 1 % for gamma from 1 to 7.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping

import numpy as np

GRAVITY = 9.81  # m/s2

#: Hs (m) of the sea states of WMO code table 3700 (Douglas sea scale): middle of each range, for
#: "phenomenal" (9) its lower end
SIGNIFICANT_HEIGHTS = (0.0, 0.05, 0.3, 0.875, 1.875, 3.25, 5.0, 7.5, 11.5, 14.0)

#: peak enhancement factor: mean JONSWAP sea, and range in which the normalising factor is valid
GAMMA, MIN_GAMMA, MAX_GAMMA = 3.3, 1.0, 7.0

#: function of frequencies (rad/s), Hs (m), Tp (s) and gamma
Spectrum = Callable[[np.ndarray, float, float, float], np.ndarray]


def pierson_moskowitz(
    frequency: np.ndarray, significant_height: float, peak_period: float, _gamma: float = 1.0
) -> np.ndarray:
    """Return the Pierson-Moskowitz spectrum.

    Args:
        frequency: Angular frequencies > 0 (rad/s).
        significant_height: Hs (m).
        peak_period: Tp (s).
        _gamma: Unused; all spectra have the same arguments.

    Returns:
        S (m2 s), with the shape of `frequency`.
    """
    ratio = (2 * math.pi / peak_period / frequency) ** 4
    spectrum: np.ndarray = (
        5 / 16 * significant_height**2 * ratio / frequency * np.exp(-5 / 4 * ratio)
    )
    return spectrum


def jonswap(
    frequency: np.ndarray, significant_height: float, peak_period: float, gamma: float = GAMMA
) -> np.ndarray:
    """Return the JONSWAP spectrum.

    Args:
        frequency: Angular frequencies > 0 (rad/s).
        significant_height: Hs (m).
        peak_period: Tp (s).
        gamma: Peak enhancement factor.

    Returns:
        S (m2 s), with the shape of `frequency`.
    """
    peak = 2 * math.pi / peak_period
    width = np.where(frequency <= peak, 0.07, 0.09)
    enhancement = gamma ** np.exp(-(((frequency - peak) / (width * peak)) ** 2) / 2)
    factor = 1 - 0.287 * math.log(gamma)
    return factor * pierson_moskowitz(frequency, significant_height, peak_period) * enhancement


SPECTRA: Mapping[str, Spectrum] = {"pierson_moskowitz": pierson_moskowitz, "jonswap": jonswap}


def fully_developed_period(significant_height: float) -> float:
    """Return the peak period (s) of a fully developed sea with a height Hs (m).

    Wp = 0.4 sqrt(g / Hs) (Fossen 2021, 10.2.1).
    """
    return 2 * math.pi / 0.4 * math.sqrt(significant_height / GRAVITY)
