"""A coverage as the API answers it and files hold it."""

from pydantic import BaseModel, ConfigDict, Field

from ars_web.datasets.coverage import Coverage


class _Record(BaseModel):
    model_config = ConfigDict(frozen=True)


class EqualAreaJson(_Record):
    """The cells of equal area."""

    directions: list[tuple[float, float, float]] = Field(description="the middle of each cell, in the box's frame")
    counts: list[int] = Field(description="views in each cell")
    reachable: list[bool] = Field(description="false: the class's symmetry folds all directions of the cell elsewhere")
    bands: list[int] = Field(description="cells in each band from +z downward; they follow one another by azimuth")
    band_edges: list[float] = Field(description="z of the bands' edges, from 1 down to -1")
    empty_fraction: float = Field(description="of the reachable cells: the share of all directions without a view")


class CoverageJson(_Record):
    """From where objects are seen: theta = polar angle from +z, phi = azimuth, in the box's frame, radians."""

    azimuth_edges: list[float] = Field(description="from -pi to pi")
    polar_edges: list[float] = Field(description="from 0 to pi")
    counts: list[list[int]] = Field(description="views by azimuth bin, then by polar bin")
    reachable: list[list[bool]] = Field(description="false: the class's symmetry folds all of the bin elsewhere")
    equal_area: EqualAreaJson
    frames: int = Field(description="in which any of the objects is labelled")
    views: int = Field(description="labels of the objects in all frames")
    empty_fraction: float = Field(description="of the reachable bins of equal angles, those without a view")


def coverage_json(coverage: Coverage) -> CoverageJson:
    """A coverage for the API and for files."""
    bins = coverage.bins
    x, y, z = (column.round(9).tolist() for column in bins.cell_directions.T)
    return CoverageJson(
        azimuth_edges=bins.azimuth_edges.tolist(),
        polar_edges=bins.polar_edges.tolist(),
        counts=coverage.counts.tolist(),
        reachable=coverage.reachable.tolist(),
        equal_area=EqualAreaJson(
            directions=list(zip(x, y, z, strict=True)),
            counts=coverage.cell_counts.tolist(),
            reachable=coverage.cells_reachable.tolist(),
            bands=bins.bands.tolist(),
            band_edges=bins.band_edges.tolist(),
            empty_fraction=coverage.empty_area,
        ),
        frames=coverage.frames,
        views=coverage.views,
        empty_fraction=coverage.empty_fraction,
    )
