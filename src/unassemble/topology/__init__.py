"""From the sparsity graph to faces, orientation, boundary loops and pieces; no coordinates here."""

from .cycles import (
    chordless_four_cycles as chordless_four_cycles,
    not_faces as not_faces,
    separating as separating,
    three_cycles as three_cycles,
)
from .keys import with_sides as with_sides
from .numbering import LocalNumbering as LocalNumbering, components as components, local_numbering as local_numbering
from .orientation import loops as loops
from .pieces import planar_pieces as planar_pieces
from .polygons import Polygons as Polygons
from .recognise import located as located, require_planar as require_planar, surfaces as surfaces
from .surface import Piece as Piece, Topology as Topology
