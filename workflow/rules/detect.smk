# Search every recording for its best candidate, and apply the detectors to the unlabelled
# recordings.
#
# takes: results/signals/, results/matrices/, results/recordings.csv, results/templates.npz
# gives: results/passages/<set>.csv, results/features/<set>.npz, results/detections.csv,
#        results/detectors.json; a set is a folder, or a part of a large one

DETECT_SECTIONS = ["detectors", "evaluation", "fit", "preprocessing", "recording"]
DETECT_SECTIONS += DETECTOR_SECTIONS
BY_FEATURES = any(row.by_features for row in DETECTORS)


wildcard_constraints:
    search_set="[^/]+(/set-[01]+)?",


rule passages:
    input:
        signals=files_of("signals", recordings_of_search_set),
        script=script("passages.py"),
    output:
        "results/passages/{search_set}.csv",
    log:
        "results/logs/passages/{search_set}.log",
    conda:
        "../../environment.yml"
    params:
        results=results_folder,
        recordings=recordings_of_search_set,
        rate_hz=config["recording"]["rate_hz"],
        settings=section("diagonal"),
        made_from=made_from(
            "passages",
            section("diagonal"),
            as_parameter(config["recording"]["rate_hz"]),
            members=recordings_of_search_set,
        ),
    shell:
        "python {input.script:q} {params.recordings:q}"
        " --signals {params.results:q}/signals"
        " --rate-hz {params.rate_hz} --settings {params.settings:q} --output {output:q}"
        " --record {params.made_from:q} > {log:q} 2>&1"


rule features:
    input:
        signals=files_of("signals", recordings_of_search_set),
        weights=own_file(PROJECT / "workflow" / "weights" / "scorer.npz"),
        script=script("features.py"),
    output:
        features="results/features/{search_set}.npz",
        # The report draws these to explain a score.
        stretches="results/features/{search_set}.stretches.npz",
    log:
        "results/logs/features/{search_set}.log",
    conda:
        "../../environment.yml"
    params:
        results=results_folder,
        recordings=recordings_of_search_set,
        rate_hz=config["recording"]["rate_hz"],
        settings=section("diagonal"),
        made_from=made_from(
            "features",
            section("diagonal"),
            as_parameter(config["recording"]["rate_hz"]),
            members=recordings_of_search_set,
        ),
    shell:
        "python {input.script:q} {params.recordings:q}"
        " --signals {params.results:q}/signals"
        " --weights {input.weights:q} --rate-hz {params.rate_hz} --settings {params.settings:q}"
        " --output {output.features:q} --stretches {output.stretches:q}"
        " --record {params.made_from:q} > {log:q} 2>&1"


rule detect:
    input:
        # The labelled recordings are needed too: the detectors learn their thresholds from them.
        matrices=files_of("matrices", ARCHIVE.recordings),
        passages=expand(rules.passages.output, search_set=SEARCH_SETS),
        features=(
            expand(rules.features.output.features, search_set=SEARCH_SETS) if BY_FEATURES else []
        ),
        # The templates for an unlabelled recording leave out the fits of its near copies.
        fits=files_of("fits", ARCHIVE.of_nodules()),
        recordings=rules.index.output.recordings,
        templates=rules.average.output.matrices,
        weights=rules.features.input.weights,
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
    shell:
        "python {input.script:q} --recordings {input.recordings:q}"
        " --matrices {params.results:q}/matrices --templates {input.templates:q}"
        " --fits {params.results:q}/fits --passages {input.passages:q} --features {input.features:q}"
        " --weights {input.weights:q} --settings {params.settings:q} --output {output.detections:q}"
        " --learned {output.learned:q}"
        " --record {params.made_from:q} > {log:q} 2>&1"
