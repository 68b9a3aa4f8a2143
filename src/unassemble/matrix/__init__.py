"""From a file or a scipy matrix to a clean symmetric operator."""

from .canonical import as_csr as as_csr
from .check import check_matrix as check_matrix
from .digits import Digits as Digits
from .operator import OperatorMatrix as OperatorMatrix
from .read import is_file as is_file, load as load, read_matrix as read_matrix
