"""The paper's figures and claims, measured again."""

from .regenerate import Regenerated, claims_table, comparison_table, measure, regenerate

__all__ = ["Regenerated", "claims_table", "comparison_table", "measure", "regenerate"]
