# Draw each finished survey under sessions/, for the report and for print.
#
# takes: sessions/<survey>/
# gives: results/surveys/<survey>/picture.{svg,pdf,csv}, survey.json

from capsule.survey.listed import list_surveys, survey_content

SURVEYS = list_surveys(Path(SESSIONS))
CONTENT_OF_SURVEY = {name: survey_content(Path(SESSIONS) / name) for name in SURVEYS.names}
SURVEY = step("survey", sections("diagonal"), lambda survey: [survey, CONTENT_OF_SURVEY[survey]])


rule survey:
    output:
        "results/surveys/{survey}/survey.json",
        multiext("results/surveys/{survey}/picture", ".svg", ".pdf", ".csv"),
    log:
        "results/logs/survey/{survey}.log",
    conda:
        "../environment.yml"
    params:
        **told(SURVEY),
        # The survey's files are no inputs: their content decides, not their time stamps. The job
        # compares the checksum again.
        content=lambda wildcards: CONTENT_OF_SURVEY[wildcards.survey],
        session=lambda wildcards: f"{SESSIONS}/{wildcards.survey}",
        folder=lambda wildcards: f"{RESULTS}/surveys/{wildcards.survey}",
    message:
        "draw the survey {wildcards.survey}"
    shell:
        "python {params.script:q} --session {params.session:q} --content {params.content}"
        " --settings {params.settings:q} --output {params.folder:q} > {log:q} 2>&1"
