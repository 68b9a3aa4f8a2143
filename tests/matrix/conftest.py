"""What the tests of this room share."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest


@pytest.fixture
def refused() -> Callable[..., str]:
    """Call a function that must raise, and hand back its message: one sentence with the given words."""

    def call(
        error: type[Exception], words: tuple[str, ...] | str, function: Callable, *args: Any, **options: Any
    ) -> str:
        with pytest.raises(error) as caught:
            function(*args, **options)
        message = str(caught.value)
        assert "\n" not in message
        assert 20 < len(message) < 450
        for word in (words,) if isinstance(words, str) else words:
            assert word in message
        return message

    return call
