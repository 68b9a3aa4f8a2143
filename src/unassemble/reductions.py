"""div(K grad) with a constant tensor K (paper, section 7, equation 9).

With K = S S, S symmetric, the P1 matrix of div(K grad) on a mesh x is sqrt(det K) times that of the Laplacian on
the mesh S^-1 x: x is contracted by sqrt(Kxx / Kyy) for diagonal K, where the paper has it dilated. The
Laplacian mesh comes back up to a rotation and reflection, which do not commute with S: they must be fixed before S is
applied.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .errors import InputError


@dataclass(frozen=True)
class ConstantTensor:
    """Symmetric positive definite K.

    Raises InputError if K is not finite and positive definite.
    """

    kxx: float
    kxy: float
    kyy: float

    def __post_init__(self) -> None:
        values = (self.kxx, self.kxy, self.kyy)
        positive = np.isfinite(values).all() and self.kxx > 0 and self.kyy > 0
        if not positive or abs(self.kxy) >= np.sqrt(self.kxx) * np.sqrt(self.kyy):
            raise InputError(f"`tensor` {values} is not positive definite: KXX > 0 and KXX KYY > KXY^2 are needed")
        if self.root_determinant <= 1e-8 * max(self.kxx, self.kyy):  # the root of the ratio of its eigenvalues
            raise InputError(f"`tensor` {values} is degenerate up to rounding and cannot be undone")

    @property
    def coefficients(self) -> tuple[float, float, float]:
        """(kxx, kxy, kyy), as the certificate takes them."""
        return self.kxx, self.kxy, self.kyy

    @property
    def root_determinant(self) -> float:
        """The root of det K."""
        size = max(self.kxx, self.kyy)  # taken out, so that no product overflows or vanishes
        return size * float(np.sqrt((self.kxx / size) * (self.kyy / size) - (self.kxy / size) ** 2))

    @property
    def root(self) -> NDArray[np.float64]:
        """S (2, 2): the positive square root, (K + s I) / sqrt(tr K + 2 s) with s = sqrt(det K)."""
        s = self.root_determinant
        k = np.array([[self.kxx, self.kxy], [self.kxy, self.kyy]])
        return (k + s * np.eye(2)) / np.sqrt(self.kxx + self.kyy + 2 * s)

    def to_laplacian(self, z: NDArray) -> NDArray:
        """S^-1 applied to complex positions."""
        return _apply(np.linalg.inv(self.root), z)

    def from_laplacian(self, z: NDArray) -> NDArray:
        """S applied to complex positions."""
        return _apply(self.root, z)


def _apply(matrix: NDArray, z: NDArray) -> NDArray:
    x, y = np.real(z), np.imag(z)
    return (matrix[0, 0] * x + matrix[0, 1] * y) + 1j * (matrix[1, 0] * x + matrix[1, 1] * y)
