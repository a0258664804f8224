# The detector's verdicts: on labelled recordings, judged; on unlabelled ones, given.
#
# takes: results/matrices/, results/fits/, results/templates.npz, results/recordings.csv
# gives: results/evaluation/{predictions,detection,specificity,sizing,confusion}.csv,
#        results/detections.csv


rule evaluate:
    input:
        matrices=expand("results/matrices/{recording}.npy", recording=ARCHIVE.labelled()),
        fits=expand("results/fits/{recording}.json", recording=ARCHIVE.of_nodules()),
        recordings="results/recordings.csv",
        script=script("evaluate.py"),
        library=library("evaluate.py"),
    output:
        expand(
            "results/evaluation/{table}.csv",
            table=["predictions", "detection", "specificity", "sizing", "confusion"],
        ),
    log:
        "results/logs/evaluate.log",
    conda:
        "../../environment.yml"
    params:
        settings=section("evaluation"),
        template_settings=as_parameter(TEMPLATE_SETTINGS),
        code=content_of_code("evaluate.py"),
    shell:
        "python {input.script:q} --recordings {input.recordings:q} --matrices results/matrices"
        " --fits results/fits --settings {params.settings:q}"
        " --template-settings {params.template_settings:q} --output results/evaluation"
        " > {log:q} 2>&1"


rule detect:
    input:
        matrices=expand("results/matrices/{recording}.npy", recording=ARCHIVE.unlabelled()),
        recordings="results/recordings.csv",
        templates="results/templates.npz",
        script=script("detect.py"),
        library=library("detect.py"),
    output:
        "results/detections.csv",
    log:
        "results/logs/detect.log",
    conda:
        "../../environment.yml"
    params:
        code=content_of_code("detect.py"),
    shell:
        "python {input.script:q} --recordings {input.recordings:q} --matrices results/matrices"
        " --templates {input.templates:q} --output {output:q} > {log:q} 2>&1"
