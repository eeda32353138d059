# One image for everything, run as a user without rights:
#   docker build -t ars-web .
#   docker run --rm -p 127.0.0.1:8000:8000 -v ars-sessions:/sessions -v "$PWD/recordings":/recordings:ro \
#       ars-web serve --host 0.0.0.0 --root recordings=/recordings
#   docker run --rm -v ars-sessions:/sessions -v "$PWD/datasets":/datasets ars-web export desk --format yolo --out /datasets/desk

FROM debian:bookworm-slim AS build
RUN apt-get update \
    && apt-get install -y --no-install-recommends python3 python3-venv \
    && rm -rf /var/lib/apt/lists/*
RUN python3 -m venv /opt/ars-web
ENV PATH=/opt/ars-web/bin:$PATH PIP_NO_CACHE_DIR=1 PIP_DISABLE_PIP_VERSION_CHECK=1
WORKDIR /source
COPY constraints.txt pyproject.toml setup.py README.md LICENSE ./
COPY ars_web ars_web
COPY static static
# The build tool is pinned like everything else, and left behind with pip once the work is done.
RUN pip install -c constraints.txt setuptools \
    && pip install -c constraints.txt --no-build-isolation . \
    && pip uninstall -y setuptools pip

FROM debian:bookworm-slim
RUN apt-get update \
    && apt-get install -y --no-install-recommends python3 \
    && rm -rf /var/lib/apt/lists/* \
    && useradd --uid 1000 --create-home ars \
    && install -d -o ars -g ars /sessions /var/cache/ars-web
COPY --from=build /opt/ars-web /opt/ars-web
ENV PATH=/opt/ars-web/bin:$PATH \
    ARS_WEB_SESSIONS=/sessions \
    NUMBA_CACHE_DIR=/var/cache/ars-web \
    PYTHONUNBUFFERED=1
USER ars
WORKDIR /sessions
# Shows that the image works, and leaves the compiled kernels for the first real use.
RUN ars-web demo --no-serve --sessions /tmp/demo \
    && ars-web tour demo --sessions /tmp/demo \
    && ars-web report demo --sessions /tmp/demo --out /tmp/demo/report.html \
    && rm -r /tmp/demo \
    && ars-web check
VOLUME /sessions
EXPOSE 8000
HEALTHCHECK --interval=30s --timeout=5s --start-period=20s \
    CMD ["python3", "-c", "from urllib.request import urlopen; urlopen('http://127.0.0.1:8000/api/health', timeout=4)"]
ENTRYPOINT ["ars-web"]
CMD ["serve", "--host", "0.0.0.0"]
