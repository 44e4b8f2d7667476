// The order of what a search finds: a page comes the earlier, the more of the words asked for are its title, and the
// more of its title they are. The numbers are those of Sphinx, of which one file has to be all there is.
// In a folder no browser lets a page read others, for what stands around the words that are found.
if (location.protocol === "file:") DOCUMENTATION_OPTIONS.SHOW_SEARCH_SUMMARY = false;
var Scorer = {
  objNameMatch: 11,
  objPartialMatch: 6,
  objPrio: { 0: 15, 1: 5, 2: -5 },
  objPrioDefault: 0,
  title: 15,
  partialTitle: 7,
  term: 5,
  partialTerm: 2,

  stems: (text) => {
    const stemmer = new Stemmer();
    const left_out = new Set(stopwords);
    const kept = splitQuery(text.toLowerCase()).filter((word) => !left_out.has(word));
    return new Set(kept.map((word) => stemmer.stemWord(word)));
  },

  score: ([, title, , , score]) => {
    const asked = Scorer.stems(new URLSearchParams(window.location.search).get("q"));
    const named = Scorer.stems(title);
    const both = [...asked].filter((stem) => named.has(stem)).length;
    return score + (both ? (60 * both) / (asked.size + named.size) : 0);
  },
};
