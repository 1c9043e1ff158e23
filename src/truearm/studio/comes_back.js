// Where the studio does not answer, a line says so, and the page is loaded anew once it does. Chromium delays connections
// that failed often by up to five seconds; the page itself gives up after one and tries again, so it would wait for ever.
(() => {
  const often = 1000, seldom = 5000;
  let said = null;
  const say = () => {
    said = document.createElement("div");
    said.id = "no-answer";
    said.textContent = "The studio does not answer: it has ended, or was restarted. This page comes back with it.";
    said.style.cssText =
      "position:fixed;left:15px;top:20%;max-width:30em;padding:0.6em 1em;background:var(--mantine-color-body,#fff);color:var(--mantine-color-text,#222);" +
      "border-left:4px solid #c77700;font:15px sans-serif;z-index:1000;pointer-events:none";
    document.body.append(said);
  };
  const look = async () => {
    let answers = false;
    try {
      await fetch("/alive", { cache: "no-store" });
      answers = true; // be it a refusal, which the page then shows
    } catch {
      // nobody is there
    }
    if (answers && said) return location.reload();
    if (!answers && !said) say();
    setTimeout(look, said ? often : seldom);
  };
  addEventListener("DOMContentLoaded", () => setTimeout(look, seldom));
})();
