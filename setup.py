"""What pyproject.toml cannot say: the page in `static/`, at the root of the checkout, is installed as `ars_web/static`."""

from setuptools import find_namespace_packages, setup

setup(
    packages=[*find_namespace_packages(include=["ars_web", "ars_web.*"]), "ars_web.static"],
    package_dir={"ars_web.static": "static"},
)
