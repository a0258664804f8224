// Set up the interactive parts of the page, if the page has them.

/** Let a reader move the prevalence. The page carries what each verdict means at each prevalence, in words. */
function setUpMeaning() {
  const slider = byId("prevalence");
  if (!slider) return;
  const at = JSON.parse(byId("meaning").dataset.values);
  slider.hidden = false;
  slider.addEventListener("input", () => {
    byId("prevalence-shown").textContent = slider.value;
    for (const [id, [value, range]] of Object.entries(at[slider.value])) {
      document.querySelector(`#${id} strong`).textContent = `${value} of 100`;
      document.querySelector(`#${id} span`).textContent = `(${range})`;
    }
  });
}

document.querySelectorAll("main table").forEach((table) => addTableTools(table, table.id));
document.querySelectorAll("main figure[id]").forEach(addFigureTools);
addEventListener("hashchange", openFolds);
openFolds();
setUpSurveys();
setUpMeaning();
const pageData = byId("page-data");
if (pageData) setUpShown(JSON.parse(pageData.textContent), setUpTable(byId("recordings-table")));
