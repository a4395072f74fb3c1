#include "tools/report/sheet.hpp"

#include <algorithm>
#include <array>

#include "tools/report/document_head.hpp"
#include "tools/report/html.hpp"

namespace probebox::report {

std::size_t Sheet::failed() const {
  return static_cast<std::size_t>(std::ranges::count(rows, SheetRow::Verdict::failed, &SheetRow::verdict));
}

std::string verdictText(SheetRow::Verdict verdict) {
  constexpr std::array kTexts{"passed", "FAILED", "no limit", "not told by this box"};
  return kTexts.at(static_cast<std::size_t>(verdict));
}

std::string sheetPage(const Sheet& sheet, const std::string& version) {
  const auto failed = sheet.failed();
  std::string text = documentHead(sheet.title + ": " + sheet.box) + "<article>\n" + element("h1", sheet.title) +
                     "\n<p class=\"small\">" + escaped(sheet.box) + ", " + escaped(sheet.when) +
                     (sheet.by.empty() ? "" : ", " + escaped(sheet.by)) + ", over " + escaped(sheet.where) + "</p>\n";
  text += failed == 0 ? "<div class=\"verdict pass\"><p>PASSED</p></div>\n"
                      : "<div class=\"verdict failed\"><p>FAILED: " + std::to_string(failed) + " of " +
                            std::to_string(sheet.rows.size()) + " lines</p></div>\n";
  text += "<table>\n<tr><th>what</th><th>measured</th><th>limit</th><th></th></tr>\n";
  for (const auto& row : sheet.rows) {
    const auto verdict = verdictText(row.verdict);
    text += "<tr>" + element("td", row.title) + element("td", row.measured) + element("td", row.limit) + "<td>" +
            (row.verdict == SheetRow::Verdict::failed ? element("strong", verdict) : escaped(verdict)) + "</td></tr>\n";
  }
  return text + "</table>\n</article>\n<p class=\"small\">probebox " + escaped(version) +
         "; measured over the link that is named above. A line without a limit decides "
         "nothing.</p>\n</body>\n</html>\n";
}

}  // namespace probebox::report
