"""The 2002 paper, whole: angle equations, Newton, inner-outer iteration, starting guesses, embeddings, boundary.

Stathopoulos, Teng, "Recovering mesh geometry from a stiffness matrix", Numerical Algorithms 30, 2002.
Every file is one idea, and names the section and the equations that it follows.
"""

from .recover import AngleOptions, AngleRecovery, recover_angles

__all__ = ["AngleOptions", "AngleRecovery", "recover_angles"]
