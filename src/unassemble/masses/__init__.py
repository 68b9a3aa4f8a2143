"""Mass matrices: alone, beside a stiffness matrix, or in one sum with it, and scaled unknowns, which sums tell from it.

`cells` says what they look like, and what entries and row sums say of the areas; `lengths` and `settled` find those
that these do not tell; `held` judges what was found by the whole matrix.
"""

from .beside import weighed as weighed
from .held import RowSums as RowSums
from .recover import (
    recover_elements_with_terms as recover_elements_with_terms,
    recover_with_terms as recover_with_terms,
)
from .settled import less_mass as less_mass
