# The service in a container:
#   docker build -t cloudchamber .
#   docker run --read-only --tmpfs /tmp:exec -p 8080:8080 cloudchamber
# So everything is kept in memory. In a volume, uploads and compiled kernels (a quick start) outlive the container:
#   docker run --read-only --tmpfs /tmp:exec -v cloudchamber:/data -e CLOUDCHAMBER_DATA_DIR=/data -p 8080:8080 cloudchamber
# With a binary built on a Debian 12 machine; the context is the folder that it lies in:
#   docker build -t cloudchamber -f Dockerfile --build-arg BINARY=prebuilt target/release
# tests/docker.sh tries this without a registry and without Docker. Buildah and Podman before 1.29 and 4.4 (Debian 12's)
# take a stage's name from an argument only if it is given: there, add --build-arg BINARY=built.
ARG BASE=debian:bookworm-slim
ARG BUILDER=rust:1-bookworm
ARG BINARY=built

FROM ${BUILDER} AS built
WORKDIR /src
COPY . .
RUN --mount=type=cache,target=/usr/local/cargo/registry --mount=type=cache,target=/src/target \
    cargo build --release --locked && strip -g -o /cloudchamber target/release/cloudchamber

FROM scratch AS prebuilt
COPY cloudchamber /cloudchamber

FROM ${BINARY} AS binary

FROM ${BASE}
# PoCL compiles kernels while the service runs: it needs its clang libraries (which it depends on) and a linker.
RUN apt-get update \
    && DEBIAN_FRONTEND=noninteractive apt-get install -y --no-install-recommends \
        binutils ocl-icd-libopencl1 pocl-opencl-icd \
    && rm -rf /var/lib/apt/lists/* /var/cache/apt/*.bin \
    && useradd --uid 10001 --no-create-home --shell /usr/sbin/nologin cloudchamber \
    && install -d -o cloudchamber /data
COPY --from=binary /cloudchamber /usr/local/bin/cloudchamber
USER 10001
# The data folder holds the kernels that PoCL compiled, so it must be writable and executable.
# `docker stop` kills after 10 s: running renders get less than that to end.
ENV CLOUDCHAMBER_LISTEN=0.0.0.0:8080 \
    CLOUDCHAMBER_DATA_DIR=/tmp/cloudchamber \
    CLOUDCHAMBER_DRAIN_MS=6000
EXPOSE 8080
STOPSIGNAL SIGTERM
HEALTHCHECK --interval=30s --timeout=6s --start-period=10s CMD ["cloudchamber", "healthcheck"]
ENTRYPOINT ["cloudchamber"]
CMD ["serve"]
