#include <filesystem>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <random>
#include <string>
#include <vector>

#include "answers_entry.hpp"
#include "firmware/json/result_json.hpp"
#include "firmware/metrology/solve.hpp"
#include "host-tests/support/sanitized.hpp"
#include "require.hpp"
#include "tools/case/case_folder.hpp"
#include "tools/case/solve_json.hpp"

// The fuzzer's entry without a fuzzer: the answer to a case of every method, then with places of it exchanged for what
// another program or a person might have written there, the same every time.
namespace probebox {
namespace {

using Json = nlohmann::ordered_json;

std::vector<Json> answers() {
  std::vector<Json> all;
  for (const auto& entry : std::filesystem::directory_iterator{PROBEBOX_CASES}) {
    const auto dataset = casefolder::readCase(entry.path());
    if (!dataset) continue;
    const auto solved = metrology::solve(*dataset);
    all.push_back(solved ? casefolder::toJson(*solved, "case")
                         : casefolder::toJson(solved.error(), dataset->method, "case"));
    if (solved) all.push_back(Json::parse(json::toJson(*solved)));
  }
  return all;
}

// Some place of it, any depth.
Json& placeIn(Json& json, std::mt19937_64& random) {
  Json* here = &json;
  while (here->is_structured() && !here->empty() && random() % 5 != 0) {
    auto child = here->begin();
    std::advance(child, static_cast<std::ptrdiff_t>(random() % here->size()));
    here = &*child;
  }
  return *here;
}

Json other(std::mt19937_64& random) {
  switch (random() % 14) {
    case 0:
      return nullptr;
    case 1:
      return true;
    case 2:
      return -1;
    case 3:
      return 0;
    case 4:
      return 1e308;
    case 5:
      return -1e308;
    case 6:
      return std::uint64_t{1} << 63U;
    case 7:
      return "";
    case 8:
      return "<script>alert(1)</script>\x1b[2J";
    case 9:
      return Json::array();
    case 10:
      return Json::object();
    case 11:
      return Json{{nullptr, "x"}, {1, 2, 3}};
    case 12:
      return Json{{"tau_s", nullptr}, {"tau_s[99999]", 1}};
    default:
      return 1e-320;
  }
}

void feed(const std::string& text) {
  ASSERT_EQ(feedAnswers(reinterpret_cast<const std::uint8_t*>(text.data()), text.size()), 0);
}

TEST(AnswersFuzz, OddAnswersAreShownOrRefusedWithTheirPlace) {
  constexpr int kRounds = support::kSanitized ? 300 : 3000;
  const auto all = answers();
  ASSERT_GT(all.size(), 30U);
  for (const auto& answer : all) feed(answer.dump());
  std::mt19937_64 random{20261124};
  for (int round = 0; round < fuzz::rounds(kRounds); ++round) {
    Json answer = all.at(random() % all.size());
    for (auto times = 1 + random() % 3; times > 0; --times) {
      auto& place = placeIn(answer, random);
      if (random() % 6 == 0 && place.is_array() && !place.empty()) {
        place.erase(place.begin());
      } else if (random() % 6 == 0 && place.is_array()) {
        const Json twice = place;
        place.insert(place.end(), twice.begin(), twice.end());
      } else {
        place = other(random);
      }
    }
    feed(answer.dump());
  }
}

TEST(AnswersFuzz, DamagedTextIsRefusedWithItsPlace) {
  const auto all = answers();
  std::mt19937_64 random{3};
  for (int round = 0; round < 500; ++round) {
    auto text = all.at(random() % all.size()).dump();
    for (auto times = 1 + random() % 4; times > 0; --times)
      text.at(random() % text.size()) = static_cast<char>(random());
    if (random() % 3 == 0) text.resize(random() % text.size());
    feed(text);
  }
}

}  // namespace
}  // namespace probebox
