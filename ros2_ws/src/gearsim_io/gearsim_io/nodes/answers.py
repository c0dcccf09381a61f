"""How all services of all nodes answer: done in one sentence, or refused in one line."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from gearsim_io.errors import InputError

__all__ = ["answer"]


def answer(response: Any, logger: Any, act: Callable[[], str]) -> Any:
    """Fill `success` and `message` of a response with what comes of `act`, and log it.

    Parameters
    ----------
    response : message
        Of a service, with these two fields.
    logger : rclpy logger
    act : callable
        Does what is asked and tells it in words; what it refuses it refuses with InputError.

    Returns
    -------
    message
        The response.
    """
    try:
        response.message = act()
        response.success = True
        logger.info(response.message)
    except InputError as error:
        response.message = " ".join(str(error).split())
        response.success = False
        logger.warning(response.message)
    return response
