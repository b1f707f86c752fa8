# Two stages: one with pip and a compiler's patience, one with only what runs.
FROM python:3.11-slim-bookworm AS build
ENV PIP_DISABLE_PIP_VERSION_CHECK=1 PIP_NO_CACHE_DIR=1 PYTHONDONTWRITEBYTECODE=1
WORKDIR /srv/joymap
RUN python -m venv .venv
COPY requirements requirements
RUN .venv/bin/pip install -r requirements/run.lock
COPY pyproject.toml README.md ./
COPY models models
COPY app app
RUN .venv/bin/pip install --no-deps -e .
RUN .venv/bin/pip download --no-deps --require-hashes -r requirements/panda.lock -d wheels && .venv/bin/python -m models.panda_pack --wheel wheels/example_robot_data-*.whl --out panda && rm -r wheels

FROM python:3.11-slim-bookworm
RUN useradd --create-home --uid 10001 joymap && install -d -o joymap /srv/joymap /srv/data
WORKDIR /srv/joymap
COPY --from=build --chown=joymap /srv/joymap .
COPY --chown=joymap static static
COPY --chown=joymap migrations migrations
USER joymap
ENV JOYMAP_HOST=0.0.0.0 JOYMAP_PORT=8000 JOYMAP_DATA_DIR=/srv/data JOYMAP_PANDA_DIR=/srv/joymap/panda JOYMAP_PUBLIC_URL=http://127.0.0.1:8000
VOLUME /srv/data
EXPOSE 8000
HEALTHCHECK --interval=10s --timeout=3s --start-period=30s CMD [".venv/bin/python", "-c", "import os, urllib.request as u; u.urlopen('http://127.0.0.1:' + os.environ['JOYMAP_PORT'] + '/health', timeout=2)"]
CMD [".venv/bin/joymap", "serve"]
