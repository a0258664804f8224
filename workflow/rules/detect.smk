# Apply the detectors to the unlabelled recordings, and combine the passes over one place.
#
# takes: results/recordings.csv, results/matrices/, results/fits/, results/best_places/,
#        results/features/, results/templates.npz, results/evaluation/predictions.csv
# gives: results/detections.csv, results/sites.csv, results/detectors.json

DETECT = step(
    "detect",
    sections("detectors", "evaluation", "fit", "preprocessing", "recording", *DETECTOR_SECTIONS),
    lambda _: [LIST.key(), TEMPLATES.key(), EVALUATE.key(), *map(DESCRIBE.key, DESCRIBED)],
    modules=DETECTOR_MODULES,
    beside=[WEIGHTS],
)


rule detect:
    input:
        best_places=each("describe", DESCRIBED, "best_places"),
        features=each("describe", DESCRIBED, "features"),
        matrices=each("preprocess", BATCHES, "matrices"),
        fits=each("fit", NODULES),
        recordings=rules.list.output[0],
        templates=rules.templates.output.matrices,
        predictions=rules.evaluate.output.predictions,
    output:
        detections=shown("results/detections.csv", "verdicts", "Verdicts"),
        # `capsule record` judges a new recording with this file and the templates alone.
        learned="results/detectors.json",
        sites=shown("results/sites.csv", "verdicts", "Verdicts"),
    log:
        "results/logs/detect.log",
    conda:
        "../environment.yml"
    params:
        **told(DETECT),
        code_of=lambda _: " ".join(s.code for s in (PREPROCESS, FIT, DESCRIBE, TEMPLATES, EVALUATE)),
    message:
        "detect nodules in the unlabelled recordings"
    shell:
        "python {params.script:q} --recordings {input.recordings:q} --results {params.results:q}"
        " --templates {input.templates:q} --predictions {input.predictions:q}"
        " --settings {params.settings:q} --code {params.code_of:q} --output {output.detections:q}"
        " --learned {output.learned:q} --sites {output.sites:q} > {log:q} 2>&1"
