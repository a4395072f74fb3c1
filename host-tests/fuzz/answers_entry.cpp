#include "answers_entry.hpp"

#include <span>
#include <string>
#include <string_view>

#include "firmware/json/result_json.hpp"
#include "require.hpp"
#include "tools/case/quantities.hpp"
#include "tools/report/page.hpp"
#include "tools/report/subjects.hpp"

using namespace probebox;
using fuzz::require;

int feedAnswers(const std::uint8_t* data, std::size_t size) {
  fuzz::feeding({data, size});
  // A box tells a result as a document of its own, which `show` prints.
  if (const auto result = json::resultFromJson({reinterpret_cast<const char*>(data), size}))
    static_cast<void>(casefolder::quantitiesOf(*result));
  const auto subjects = report::subjectsOf({reinterpret_cast<const char*>(data), size}, "answers");
  if (!subjects) {
    require(subjects.error().what.starts_with("answers"), subjects.error().what);
    return 0;
  }
  const auto page = report::page(*subjects, "test");
  require(page.starts_with("<!DOCTYPE html>"));
  return 0;
}
