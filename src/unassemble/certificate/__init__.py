"""What a result is worth: the operator re-assembled on the mesh as it is written, held against the matrix.

Nothing here knows how a mesh was found: the room imports no solver and no recovery.
"""

from .bodies import (
    BodyCertificate as BodyCertificate,
    certify_body as certify_body,
    certify_positions as certify_positions,
)
from .boundary import (
    BoundaryCertificate as BoundaryCertificate,
    certify_with_boundary_terms as certify_with_boundary_terms,
)
from .comparison import Certificate as Certificate, Terms as Terms, compared as compared
from .lengths import MetricCertificate as MetricCertificate, certify_metric as certify_metric
from .masses import certify_masses as certify_masses
from .noise import chi_square_verdict as chi_square_verdict
from .planar import certify as certify, certify_mesh as certify_mesh
from .spare import without_spare_equations as without_spare_equations
from .structures import (
    StructureCheck as StructureCheck,
    check_structure as check_structure,
)
from .trusses import check_bars as check_bars
from .verdict import (
    UNJUDGED as UNJUDGED,
    Findings as Findings,
    Status as Status,
    Unique as Unique,
    Uniqueness as Uniqueness,
    Verdict as Verdict,
    judge as judge,
)
