"""What pyproject.toml cannot say: the page, `static/` at the checkout's root, is installed as `ars_web/static`."""

from setuptools import find_namespace_packages, setup

setup(
    packages=[*find_namespace_packages(include=["ars_web", "ars_web.*"]), "ars_web.static"],
    package_dir={"ars_web.static": "static"},
)
