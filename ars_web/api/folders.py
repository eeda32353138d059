"""`/api/roots`: the declared folders, and what lies in them, to choose a recording from."""

from typing import Annotated

from fastapi import APIRouter, Query

from ars_web.api.dependencies import ServicesDep, StrictRoute
from ars_web.api.import_models import FoldersJson, relative_path
from ars_web.api.models import RootJson
from ars_web.api.problems import documented
from ars_web.api.roots import declared_root, safe_join, told_within
from ars_web.recordings.browsing import browse
from ars_web.recordings.options import ReadOptions

router = APIRouter(prefix="/api/roots", tags=["imports"], route_class=StrictRoute)


@router.get("", operation_id="roots-list", responses=documented())
def roots(services: ServicesDep) -> list[RootJson]:
    """The folders that recordings may be imported from, by the names that the server was started with."""
    return [RootJson(name=name) for name in services.roots]


@router.get("/{name}/folders", operation_id="folders-list", responses=documented(404))
def folders(
    name: str,
    services: ServicesDep,
    path: Annotated[str, Query(max_length=4096, description="relative to the root, with /")] = "",
) -> FoldersJson:
    """The folders in a folder below a declared root, which of them are recordings, and the files that are."""
    root = declared_root(services.roots, name)
    folder = safe_join(root, path)
    with told_within(ReadOptions(within=root)):
        return FoldersJson.of(browse(folder, within=root), path=relative_path(folder, root))
