# Draw each finished survey under sessions/.
#
# takes: sessions/<survey>/, config/phantom.yaml
# gives: results/surveys/<survey>/picture{,_column}.svg, picture.csv, survey.json; on request
#        (snakemake -c2 figures) for print, results/print/surveys/<survey>/picture{,_column}.pdf

from edges.survey_list import list_surveys, survey_content

SURVEYS = list_surveys(Path(SESSIONS))


rule chart_survey:
    input:
        phantom=own_file(PROJECT / "config" / "phantom.yaml"),
        script=script("chart_survey.py"),
    output:
        # The report shows these values.
        values="results/surveys/{survey}/survey.json",
        pictures=expand("results/surveys/{{survey}}/picture{width}.svg", width=["", "_column"]),
        table="results/surveys/{survey}/picture.csv",
    log:
        "results/logs/chart_survey/{survey}.log",
    wildcard_constraints:
        survey="[^/]+",
    conda:
        "../../environment.yml"
    params:
        settings=section("diagonal"),
        # The survey's files are no inputs: their content decides whether the job runs again, not
        # their time stamps.
        session=lambda wildcards: f"{SESSIONS}/{wildcards.survey}",
        content=lambda wildcards: survey_content(Path(SESSIONS) / wildcards.survey),
        made_from=made_from("chart_survey", section("diagonal")),
        folder=lambda wildcards: f"{RESULTS}/surveys/{wildcards.survey}",
    shell:
        "python {input.script:q} --session {params.session:q} --phantom {input.phantom:q}"
        " --settings {params.settings:q} --kind svg --output {params.folder:q}"
        " --record {params.made_from:q} > {log:q} 2>&1"


rule print_survey:
    input:
        phantom=own_file(PROJECT / "config" / "phantom.yaml"),
        script=script("chart_survey.py"),
    output:
        expand("results/print/surveys/{{survey}}/picture{width}.pdf", width=["", "_column"]),
    log:
        "results/logs/print_survey/{survey}.log",
    wildcard_constraints:
        survey="[^/]+",
    conda:
        "../../environment.yml"
    params:
        settings=section("diagonal"),
        session=lambda wildcards: f"{SESSIONS}/{wildcards.survey}",
        content=lambda wildcards: survey_content(Path(SESSIONS) / wildcards.survey),
        made_from=made_from("print_survey", section("diagonal"), script="chart_survey.py"),
        folder=lambda wildcards: f"{RESULTS}/print/surveys/{wildcards.survey}",
    shell:
        "python {input.script:q} --session {params.session:q} --phantom {input.phantom:q}"
        " --settings {params.settings:q} --kind pdf --output {params.folder:q}"
        " --record {params.made_from:q} > {log:q} 2>&1"
