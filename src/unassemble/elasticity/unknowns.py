from dataclasses import dataclass
import numpy as np
from numpy.typing import NDArray

@dataclass(frozen=True, eq=False)
class Numbering:
    block_size: int
    node_of_row: NDArray[np.int64]
    direction_of_row: NDArray[np.int64]
    identity_row: NDArray[np.bool_]
    kind: str

    @property
    def n_nodes(self) -> int:
        return int(self.node_of_row.max()) + 1
