"""`/api/health`: that the server is up, for whoever asks."""

from fastapi import APIRouter

from ars_web import __version__
from ars_web.api.models import HealthJson

router = APIRouter(prefix="/api/health", tags=["health"])


@router.get("", operation_id="health-get")
def health() -> HealthJson:
    """Whether the server is up, and its version; open to all."""
    return HealthJson(version=__version__)
