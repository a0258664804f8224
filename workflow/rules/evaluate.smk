# The detectors' verdicts: on labelled recordings, judged; on unlabelled ones, given.
#
# takes: results/signals/, results/matrices/, results/fits/, results/templates.npz,
#        results/recordings.csv
# gives: results/passages/<folder>.csv, results/detections.csv, results/detectors.json,
#        results/sites.csv, and under results/evaluation/
#        {predictions,group_predictions,detection,specificity,sizing,confusion}.csv and the tables
#        of capsule.evaluation.columns

FOLDERS = ARCHIVE.by_folder()


# A folder a job: one recording more is searched with those of its size, not with all.
rule passages:
    input:
        signals=lambda wildcards: expand(
            "results/signals/{recording}.npy", recording=FOLDERS[wildcards.folder]
        ),
        script=script("passages.py"),
        library=library("passages.py"),
    output:
        "results/passages/{folder}.csv",
    log:
        "results/logs/passages/{folder}.log",
    wildcard_constraints:
        folder="[^/]+",
    conda:
        "../../environment.yml"
    params:
        rate_hz=config["recording"]["rate_hz"],
        settings=section("diagonal"),
        code=content_of_code("passages.py"),
    shell:
        "python {input.script:q} --raw raw --folder {wildcards.folder:q} --signals results/signals"
        " --rate-hz {params.rate_hz} --settings {params.settings:q} --output {output:q}"
        " > {log:q} 2>&1"


rule evaluate:
    input:
        matrices=expand("results/matrices/{recording}.npy", recording=ARCHIVE.labelled()),
        fits=expand("results/fits/{recording}.json", recording=ARCHIVE.of_nodules()),
        passages=expand(
            "results/passages/{folder}.csv", folder=sorted(set(map(folder_of, ARCHIVE.labelled())))
        ),
        recordings="results/recordings.csv",
        script=script("evaluate.py"),
        library=library("evaluate.py"),
    output:
        expand(
            "results/evaluation/{table}.csv",
            table=[
                "predictions",
                "group_predictions",
                "detection",
                "specificity",
                "sizing",
                "confusion",
            ],
        ),
    log:
        "results/logs/evaluate.log",
    conda:
        "../../environment.yml"
    params:
        settings=section("detectors", "diagonal", "evaluation", "recording"),
        template_settings=as_parameter(TEMPLATE_SETTINGS),
        code=content_of_code("evaluate.py"),
    shell:
        "python {input.script:q} --recordings {input.recordings:q} --matrices results/matrices"
        " --fits results/fits --passages results/passages --settings {params.settings:q}"
        " --template-settings {params.template_settings:q} --output results/evaluation"
        " > {log:q} 2>&1"


rule judge:
    input:
        predictions="results/evaluation/predictions.csv",
        grouped="results/evaluation/group_predictions.csv",
        recordings="results/recordings.csv",
        script=script("judge.py"),
        library=library("judge.py"),
    output:
        expand("results/evaluation/{table}.csv", table=JUDGEMENTS),
    log:
        "results/logs/judge.log",
    conda:
        "../../environment.yml"
    params:
        settings=section("evaluation"),
        code=content_of_code("judge.py"),
    shell:
        "python {input.script:q} --recordings {input.recordings:q}"
        " --predictions {input.predictions:q} {input.grouped:q} --settings {params.settings:q}"
        " --output results/evaluation > {log:q} 2>&1"


rule detect:
    input:
        # Labelled ones too: they teach the thresholds.
        matrices=expand("results/matrices/{recording}.npy", recording=ARCHIVE.recordings),
        passages=expand("results/passages/{folder}.csv", folder=FOLDERS),
        recordings="results/recordings.csv",
        templates="results/templates.npz",
        script=script("detect.py"),
        library=library("detect.py"),
    output:
        detections="results/detections.csv",
        # With the templates all that acquire.py needs to judge a new recording.
        learned="results/detectors.json",
    log:
        "results/logs/detect.log",
    conda:
        "../../environment.yml"
    params:
        settings=section("detectors", "diagonal", "evaluation", "fit", "preprocessing", "recording"),
        code=content_of_code("detect.py"),
    shell:
        "python {input.script:q} --recordings {input.recordings:q} --matrices results/matrices"
        " --templates {input.templates:q} --passages results/passages"
        " --settings {params.settings:q} --output {output.detections:q}"
        " --learned {output.learned:q} > {log:q} 2>&1"


rule combine:
    input:
        predictions="results/evaluation/predictions.csv",
        grouped="results/evaluation/group_predictions.csv",
        detections="results/detections.csv",
        recordings="results/recordings.csv",
        script=script("combine.py"),
        library=library("combine.py"),
    output:
        "results/sites.csv",
    log:
        "results/logs/combine.log",
    conda:
        "../../environment.yml"
    params:
        settings=section("evaluation"),
        code=content_of_code("combine.py"),
    shell:
        "python {input.script:q} --recordings {input.recordings:q}"
        " --evaluation results/evaluation --detections {input.detections:q}"
        " --settings {params.settings:q} --output {output:q} > {log:q} 2>&1"
