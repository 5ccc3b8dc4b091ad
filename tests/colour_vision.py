"""Of view_in_browser.py: whether colours differ for readers of normal, protanopic and deuteranopic vision."""
import re
from itertools import combinations

# Linear RGB as it is seen: Machado, Oliveira & Fernandes, TVCG 2009, severity 1.
VISION = {
    "normal": ((1, 0, 0), (0, 1, 0), (0, 0, 1)),
    "protanopia": ((0.152286, 1.052583, -0.204868), (0.114503, 0.786281, 0.099216), (-0.003882, -0.048116, 1.051998)),
    "deuteranopia": ((0.367322, 0.860646, -0.227968), (0.280085, 0.672501, 0.047413), (-0.011820, 0.042940, 0.968881)),
}
XYZ_OVER_D65 = ((0.4339, 0.3762, 0.1899), (0.2126, 0.7152, 0.0722), (0.0177, 0.1095, 0.8728))  # of linear sRGB


def times(matrix, vector):
    return [sum(m * v for m, v in zip(row, vector)) for row in matrix]


def lab(css, vision):
    """CIELAB of a computed style such as `rgb(0, 114, 178)`."""
    linear = [c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in (int(v) / 255 for v in re.findall(r"\d+", css)[:3])]
    seen = [min(max(v, 0), 1) for v in times(VISION[vision], linear)]
    x, y, z = (v ** (1 / 3) if v > 0.008856 else 7.787 * v + 16 / 116 for v in times(XYZ_OVER_D65, seen))
    return 116 * y - 16, 500 * (x - y), 200 * (y - z)


def closest(colours):
    """The smallest difference (CIE 1976) of two of the named colours: difference, names, vision."""
    return min((sum((a - b) ** 2 for a, b in zip(lab(colours[one], vision), lab(colours[other], vision))) ** 0.5, one, other, vision)
               for one, other in combinations(colours, 2) for vision in VISION)
