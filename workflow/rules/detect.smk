# Search every recording for its best candidate, and apply the detectors to the unlabelled
# recordings.
#
# takes: results/signals/, results/matrices/, results/recordings.csv, results/templates.npz
# gives: results/passages/<folder>.csv, results/detections.csv, results/detectors.json

FOLDERS = ARCHIVE.by_folder()
DETECT_SECTIONS = ["detectors", "evaluation", "fit", "preprocessing", "recording"]
DETECT_SECTIONS += DETECTOR_SECTIONS
BY_FEATURES = any(row.by_features for row in DETECTORS)


# One job searches one folder, so a new recording repeats the search only for its size.
rule passages:
    input:
        signals=lambda wildcards: files_of("signals", FOLDERS[wildcards.folder]),
        script=script("passages.py"),
    output:
        "results/passages/{folder}.csv",
    log:
        "results/logs/passages/{folder}.log",
    wildcard_constraints:
        folder="[^/]+",
    conda:
        "../../environment.yml"
    params:
        raw=raw_folder,
        results=results_folder,
        rate_hz=config["recording"]["rate_hz"],
        settings=section("diagonal"),
        made_from=made_from(
            "passages",
            section("diagonal"),
            as_parameter(config["recording"]["rate_hz"]),
            members=lambda wildcards: FOLDERS[wildcards.folder],
        ),
    shell:
        "python {input.script:q} --raw {params.raw:q} --folder {wildcards.folder:q}"
        " --signals {params.results:q}/signals"
        " --rate-hz {params.rate_hz} --settings {params.settings:q} --output {output:q}"
        " --record {params.made_from:q} > {log:q} 2>&1"


rule features:
    input:
        signals=lambda wildcards: files_of("signals", FOLDERS[wildcards.folder]),
        weights=own_file(PROJECT / "workflow" / "weights" / "scorer.npz"),
        script=script("features.py"),
    output:
        features="results/features/{folder}.npz",
        # The report draws these to explain a score.
        stretches="results/features/{folder}.stretches.npz",
    log:
        "results/logs/features/{folder}.log",
    wildcard_constraints:
        folder="[^/]+",
    conda:
        "../../environment.yml"
    params:
        raw=raw_folder,
        results=results_folder,
        rate_hz=config["recording"]["rate_hz"],
        settings=section("diagonal"),
        made_from=made_from(
            "features",
            section("diagonal"),
            as_parameter(config["recording"]["rate_hz"]),
            members=lambda wildcards: FOLDERS[wildcards.folder],
        ),
    shell:
        "python {input.script:q} --raw {params.raw:q} --folder {wildcards.folder:q}"
        " --signals {params.results:q}/signals"
        " --weights {input.weights:q} --rate-hz {params.rate_hz} --settings {params.settings:q}"
        " --output {output.features:q} --stretches {output.stretches:q}"
        " --record {params.made_from:q} > {log:q} 2>&1"


rule detect:
    input:
        # The labelled recordings are needed too: the detectors learn their thresholds from them.
        matrices=files_of("matrices", ARCHIVE.recordings),
        passages=expand(rules.passages.output, folder=FOLDERS),
        features=expand(rules.features.output.features, folder=FOLDERS) if BY_FEATURES else [],
        # The templates for an unlabelled recording leave out the fits of its near copies.
        fits=files_of("fits", ARCHIVE.of_nodules()),
        recordings=rules.index.output.recordings,
        templates=rules.average.output.matrices,
        script=script("detect.py"),
    output:
        detections=report(
            "results/detections.csv",
            caption="../report/captions/verdicts.rst",
            category="Verdicts",
        ),
        # acquire.py judges a new recording with this file and the templates alone.
        learned="results/detectors.json",
    log:
        "results/logs/detect.log",
    conda:
        "../../environment.yml"
    params:
        results=results_folder,
        settings=section(*DETECT_SECTIONS),
        made_from=made_from(
            "detect",
            section(*DETECT_SECTIONS),
            modules=DETECTOR_MODULES,
            members=ARCHIVE.recordings,
        ),
        features=f"--features {shlex.quote(RESULTS)}/features" if BY_FEATURES else "",
    shell:
        "python {input.script:q} --recordings {input.recordings:q}"
        " --matrices {params.results:q}/matrices --templates {input.templates:q}"
        " --fits {params.results:q}/fits --passages {params.results:q}/passages {params.features}"
        " --settings {params.settings:q} --output {output.detections:q}"
        " --learned {output.learned:q}"
        " --record {params.made_from:q} > {log:q} 2>&1"
