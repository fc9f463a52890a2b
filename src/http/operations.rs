//! The operations of the service, from which `/openapi.json` is made.

/// One operation: method, path, words, body, the answers that are not problems, and the problems.
pub(super) struct Operation {
    pub method: &'static str,
    pub path: &'static str,
    pub words: &'static str,
    pub body: Body,
    pub answers: &'static [(u16, &'static str, &'static str)],
    pub problems: &'static [u16],
}

/// The body of a request.
pub(super) enum Body {
    None,
    /// JSON by the schema of this name.
    Json(&'static str),
    /// A file, which the query describes if it does not do so itself.
    Bytes,
    /// A form of files: the schema of its `meta`, and the names of the files.
    Form(&'static str, &'static [&'static str]),
}

pub(super) const JSON: &str = "application/json";
const RENDER: &[u16] = &[400, 406, 408, 413, 415, 422, 429, 501, 503];

const fn get(
    path: &'static str,
    words: &'static str,
    answers: &'static [(u16, &'static str, &'static str)],
    problems: &'static [u16],
) -> Operation {
    Operation { method: "get", path, words, body: Body::None, answers, problems }
}

const fn delete(
    path: &'static str,
    words: &'static str,
    answers: &'static [(u16, &'static str, &'static str)],
    problems: &'static [u16],
) -> Operation {
    Operation { method: "delete", path, words, body: Body::None, answers, problems }
}

/// Every operation.
pub(super) const OPERATIONS: &[Operation] = &[
    Operation {
        method: "post",
        path: "/v1/renders",
        words: "Start a render; the answer is chosen by Accept",
        body: Body::Json("RenderRequest"),
        answers: &[
            (202, JSON, "The render resource; Location names it"),
            (200, "image/png", "The final frame"),
            (200, "image/x-exr", "The final frame in linear floats"),
            (200, "multipart/x-mixed-replace", "The frames as they come"),
        ],
        problems: RENDER,
    },
    get("/v1/renders", "The renders that are kept, newest first", &[(200, JSON, "A list of summaries")], &[]),
    get(
        "/v1/renders/{id}",
        "State, plan, samples, error, timings, what stopped it, the convergence trace; waits_for names the kernel that a queued one waits for",
        &[(200, JSON, "The render resource")],
        &[404],
    ),
    delete("/v1/renders/{id}", "Cancel; the resource stays readable", &[(200, JSON, "The render resource")], &[404]),
    Operation {
        method: "put",
        path: "/v1/renders/{id}/camera",
        words: "A new camera; what was gathered is dropped, the newest camera supersedes any that wait",
        body: Body::Json("Camera"),
        answers: &[(200, JSON, "The camera in force")],
        problems: &[400, 404, 409, 413, 415, 422, 429, 503],
    },
    get(
        "/v1/renders/{id}/frames",
        "The frames as they come, each with X-Cloudchamber-{Samples,Error,Elapsed-Ms,Final}, and with -Lowered where a moving camera has less than was asked for; ends after the final one",
        &[(200, "multipart/x-mixed-replace", "PNG frames")],
        &[404, 429],
    ),
    get(
        "/v1/renders/{id}/frame.png",
        "The newest frame; ?wait=final waits for the last",
        &[(200, "image/png", "A frame with a strong ETag"), (304, "", "Not modified")],
        &[404, 409, 422, 429],
    ),
    get(
        "/v1/renders/{id}/frame.exr",
        "The newest frame in linear floats; ?wait=final waits for the last",
        &[(200, "image/x-exr", "OpenEXR"), (304, "", "Not modified")],
        &[404, 409, 422, 429],
    ),
    get(
        "/v1/renders/{id}/difference",
        "Whether this render and ?with=… (of another seed) are of the same picture: a map of z, with X-Cloudchamber-{P-Value,Pixels-Beyond,Agree,Correlated}",
        &[(200, "image/png", "White: the same; red and blue: beyond noise"), (200, JSON, "The same in numbers")],
        &[404, 406, 409, 422],
    ),
    get(
        "/v1/renders/{id}/field",
        "The grid of a field technique as NRRD",
        &[(200, "application/octet-stream", "NRRD, raw floats")],
        &[404],
    ),
    get(
        "/v1/renders/{id}/events",
        "Server-sent events: progress, final, cancelled, failed; Last-Event-ID resumes",
        &[(200, "text/event-stream", "Events")],
        &[404, 429],
    ),
    Operation {
        method: "post",
        path: "/v1/plan",
        words: "What a request would be rendered with for its max_error or time_ms, what that would cost and be wrong by, and why",
        body: Body::Json("RenderRequest"),
        answers: &[(
            200,
            JSON,
            "Technique, options, samples, predictions with intervals, reasons, the request to post",
        )],
        problems: RENDER,
    },
    get("/v1/renders/{id}/convergence.svg", "Its error against time", &[(200, "image/svg+xml", "A chart")], &[404]),
    Operation {
        method: "post",
        path: "/v1/exports",
        words: "Start an export: a technique that turns a volume or a field into a file",
        body: Body::Json("ExportRequest"),
        answers: &[(202, JSON, "The export resource; Location names it")],
        problems: &[400, 408, 413, 415, 422, 429, 503],
    },
    get("/v1/exports", "The exports that are kept, newest first", &[(200, JSON, "A list of summaries")], &[]),
    get("/v1/exports/{id}", "State, progress, result, what the file is", &[(200, JSON, "The export resource")], &[404]),
    delete("/v1/exports/{id}", "Cancel; the resource stays readable", &[(200, JSON, "The export resource")], &[404]),
    get(
        "/v1/exports/{id}/file",
        "The file; ?wait=final waits for it",
        &[
            (200, "text/csv", "What a histogram makes"),
            (200, "application/octet-stream", "NRRD: the sinogram of a projection"),
        ],
        &[404, 409, 422, 429],
    ),
    get(
        "/v1/exports/{id}/events",
        "Server-sent events: progress, final, cancelled, failed; Last-Event-ID resumes",
        &[(200, "text/event-stream", "Events")],
        &[404, 429],
    ),
    Operation {
        method: "post",
        path: "/v1/volumes",
        words: "Upload a volume: NIfTI-1, NRRD, or raw with ?dims=…&type=…&spacing=…; the id is the content's hash",
        body: Body::Bytes,
        answers: &[(201, JSON, "The new volume"), (200, JSON, "It was there already")],
        problems: &[400, 408, 413, 415, 422],
    },
    get("/v1/volumes", "Uploaded and built-in volumes", &[(200, JSON, "A list")], &[]),
    get("/v1/volumes/{id}", "Size, spacing, range, histogram", &[(200, JSON, "The volume")], &[404]),
    delete(
        "/v1/volumes/{id}",
        "Forget an uploaded volume; renders that use it go on",
        &[(204, "", "Gone")],
        &[404, 409],
    ),
    Operation {
        method: "post",
        path: "/v1/projections",
        words: "Measure a volume, a field or a phantom: an export that ends once its sinogram is kept; result.sinogram.id names it",
        body: Body::Json("ProjectionRequest"),
        answers: &[(202, JSON, "The export resource; Location names it")],
        problems: &[400, 408, 413, 415, 422, 429, 503],
    },
    Operation {
        method: "post",
        path: "/v1/sinograms",
        words: "Upload a sinogram: a form of meta (its geometry, quantity, photons_per_ray), data (NRRD, NumPy's .npy or bare numbers; u fastest, then v, then the view) and perhaps flat and dark frames; or a NRRD with the key geometry:={…}",
        body: Body::Form("SinogramMeta", &["data", "flat", "dark"]),
        answers: &[(201, JSON, "The new sinogram"), (200, JSON, "It was there already")],
        problems: &[400, 408, 413, 415, 422],
    },
    get("/v1/sinograms", "Uploaded sinograms", &[(200, JSON, "A list")], &[]),
    get(
        "/v1/sinograms/{id}",
        "Geometry, range, a check of the data by their moments",
        &[(200, JSON, "The sinogram")],
        &[404],
    ),
    get(
        "/v1/sinograms/{id}/data",
        "Its numbers: counts as they came, everything else as line integrals",
        &[
            (200, "application/octet-stream", "NRRD with its geometry"),
            (200, "application/x-npy", "NumPy's format, (views, v, u)"),
        ],
        &[404, 406],
    ),
    get(
        "/v1/sinograms/{id}/preview.png",
        "Its line integrals as a picture: ?view=… from 0, or without it the middle row of all views",
        &[(200, "image/png", "Grey, from the least to the greatest")],
        &[404, 422],
    ),
    delete("/v1/sinograms/{id}", "Forget a sinogram; reconstructions that use it go on", &[(204, "", "Gone")], &[404]),
    get(
        "/v1/studies",
        "Speed against accuracy: what was measured, and what to choose when",
        &[(200, JSON, "A list")],
        &[],
    ),
    get(
        "/v1/studies/{id}",
        "A study's numbers, those of `stability`: where methods fail, of `planner` or of `honesty`: whether stated errors hold. With .svg after its name, its chart",
        &[(200, JSON, "The numbers"), (200, "image/svg+xml", "The chart")],
        &[404],
    ),
    get(
        "/v1/techniques",
        "Every technique with the JSON Schema of its parameters and an example",
        &[(200, JSON, "A list")],
        &[],
    ),
    get(
        "/v1/device",
        "The OpenCL device in use: its limits, level and lanes, what was given up, and how far its kernels are",
        &[(200, JSON, "The device")],
        &[503],
    ),
    get("/healthz", "The process lives", &[(200, JSON, "It does")], &[]),
    get(
        "/readyz",
        "The first picture can be rendered, there is room in the queue, the server is not draining",
        &[(
            200,
            JSON,
            "Ready: how far the kernels are, those that do not build, the level, the lanes, what was given up",
        )],
        &[503],
    ),
    get("/metrics", "Prometheus metrics", &[(200, "text/plain", "Metrics")], &[]),
    get("/openapi.json", "This document", &[(200, JSON, "OpenAPI 3.1")], &[]),
];
