"""Make the assembled cases importable from the tests of this folder, and their assertions as telling as those there."""

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))
pytest.register_assert_rewrite("supported")
