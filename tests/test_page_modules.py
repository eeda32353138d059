"""The page's modules: who may import whom, and nothing from elsewhere."""

import re
from pathlib import Path

STATIC = Path(__file__).parents[1] / "static"

IMPORT = re.compile(
    r"""(?:^|\s)(?:import|export)\s[^;]*?from\s*["']([^"']+)["']|import\(\s*["']([^"']+)["']\s*\)|^import\s*["']([^"']+)["']""",
    re.M,
)

ALLOWED = {
    "lib": {"lib", "vendor"},
    "views": {"views", "lib", "store.js"},
    "store.js": {"lib"},
    "api.js": set[str](),
    "editing.js": {"api.js", "lib", "store.js"},
    "line.js": {"api.js", "lib", "store.js"},
    "login.js": {"api.js", "lib", "store.js"},
    "main.js": {"api.js", "editing.js", "lib", "line.js", "mask_editing.js", "store.js", "views"},
    "mask_editing.js": {"api.js", "editing.js", "lib", "store.js"},
}
"""Which parts each part may import; a part is a folder or a module of static/."""


def modules() -> list[Path]:
    return [
        path for path in sorted(STATIC.rglob("*.js")) if path.relative_to(STATIC).parts[0] not in ("vendor", "scene")
    ]


def imported(module: Path) -> list[str]:
    """What a module imports at run time; types are imported in comments."""
    code = re.sub(r"/\*.*?\*/", "", module.read_text(), flags=re.S)
    code = re.sub(r"^\s*//.*$", "", code, flags=re.M)
    return [next(filter(None, found)) for found in IMPORT.findall(code)]


def test_modules_import_only_what_their_part_may() -> None:
    wrong = []
    for module in modules():
        part = module.relative_to(STATIC).parts[0]
        for name in imported(module):
            target = (module.parent / name).resolve()
            assert name.startswith("."), f"{module.name} imports {name}, which no browser can find"
            assert target.is_file(), f"{module.relative_to(STATIC)} imports {name}, which is not there"
            if target.relative_to(STATIC).parts[0] not in ALLOWED[part] | ({part} if "." not in part else set()):
                wrong.append(f"{module.relative_to(STATIC)} imports {name}")
    assert wrong == []


def test_the_parts_are_those_that_are_there() -> None:
    assert {module.relative_to(STATIC).parts[0] for module in modules()} == set(ALLOWED)


def test_only_the_api_module_talks_to_the_server() -> None:
    asks = re.compile(r"(?<![#.\w])(?:fetch|XMLHttpRequest|WebSocket|EventSource|sendBeacon)\s*\(")
    assert {module.name for module in modules() if asks.search(module.read_text())} == {"api.js"}


def test_no_module_makes_markup_of_text() -> None:
    makes = re.compile(
        r"innerHTML|outerHTML|insertAdjacentHTML|dangerouslySetInnerHTML|document\.write|\beval\(|new Function"
    )
    ours = [*modules(), *sorted((STATIC / "scene").glob("*.js"))]
    assert [module.name for module in ours if makes.search(module.read_text())] == []


def test_nothing_is_loaded_from_elsewhere() -> None:
    foreign = re.compile(r"""(?:src|href)=["'](?:https?:)?//|url\(["']?(?:https?:)?//|@import|import\(["']https?:""")
    files = [path for pattern in ("*.html", "*.css", "*.js") for path in STATIC.rglob(pattern)]
    assert [str(path) for path in files if foreign.search(path.read_text())] == []
