#include "tools/case/case_folder.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <gmock/gmock.h>
#include <random>
#include <sys/stat.h>

#include "host-tests/support/file_content.hpp"
#include "scratch_folder.hpp"
#include "tools/case/csv.hpp"

namespace probebox::casefolder {
namespace {

using metrology::Dataset;
using metrology::Table;
using testing::HasSubstr;

class CaseFolder : public ScratchFolder {};

double anyDouble(std::mt19937_64& random) {
  while (true) {
    const auto value = std::bit_cast<double>(random());
    if (std::isfinite(value)) return value;
  }
}

TEST_F(CaseFolder, KeepsEveryDigitOfEveryNumber) {
  std::mt19937_64 random{1};
  Dataset dataset = metrology::touchDataset("delay-multi-speed");
  for (auto& table : dataset.tables) {
    for (auto& column : table.columns) {
      for (int row = 0; row < 500; ++row) column.values.push_back(anyDouble(random));
    }
  }
  dataset.config = {{"effective_diameter_mm", 31.1 / 3.0},
                    {"feature", std::string{"external"}},
                    {"robust", true},
                    {"swivel_axis", std::vector<double>{0.1, 0.2, 0.3}},
                    {"gain_matrix", metrology::Matrix{{1.0, 1e-17}, {0.0, -1.0}}}};
  ASSERT_TRUE(writeCase(dataset, folder_ / "case").ok());
  auto read = readCase(folder_ / "case");
  ASSERT_TRUE(read.ok());
  EXPECT_EQ(read->config, dataset.config);
  EXPECT_EQ(read->method, dataset.method);
  for (const auto& table : dataset.tables) EXPECT_EQ(*read->table(table.name), table);
}

TEST_F(CaseFolder, IsNotWrittenOver) {
  const Dataset dataset{.method = "sphere-fit", .config = {}, .tables = {}};
  ASSERT_TRUE(writeCase(dataset, folder_ / "case").ok());
  EXPECT_THAT(writeCase(dataset, folder_ / "case").error().what, HasSubstr("a case"));
}

TEST_F(CaseFolder, IsNotWrittenAmongTablesOfOthers) {
  const Dataset dataset{.method = "sphere-fit", .config = {}, .tables = {}};
  write("case/machine.csv", "precious");
  for (const auto& why : {whyNoPlaceForCase(folder_ / "case").value(), writeCase(dataset, folder_ / "case").error()})
    EXPECT_THAT(why.what, HasSubstr("machine.csv"));
  EXPECT_EQ(support::contentOf(folder_ / "case" / "machine.csv"), "precious");
  EXPECT_FALSE(std::filesystem::exists(folder_ / "case" / "config.json"));
  std::filesystem::create_directory(folder_ / "links");
  std::filesystem::create_symlink("elsewhere", folder_ / "links" / "points.csv");
  EXPECT_FALSE(writeCase(dataset, folder_ / "links").ok());
}

TEST_F(CaseFolder, IsTriedWithoutATrace) {
  EXPECT_FALSE(whyNoPlaceForCase(folder_ / "a" / "b"));
  EXPECT_FALSE(std::filesystem::exists(folder_ / "a"));
  write("case/notes.txt", "mine");
  EXPECT_FALSE(whyNoPlaceForCase(folder_ / "case"));
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator{folder_ / "case"}, {}), 1);
  for (const std::filesystem::path& bad :
       {folder_ / "case" / "notes.txt", folder_ / std::string(300, 'a'), std::filesystem::path{"/proc/x"}}) {
    ASSERT_TRUE(whyNoPlaceForCase(bad)) << bad;
    EXPECT_THAT(whyNoPlaceForCase(bad)->what, HasSubstr(bad.string() + ": cannot be made"));
  }
}

TEST_F(CaseFolder, RefusesTableNamesThatAreNoFileNames) {
  const Dataset dataset{.method = "sphere-fit", .config = {}, .tables = {{.name = "../points", .columns = {}}}};
  EXPECT_FALSE(writeCase(dataset, folder_ / "case").ok());
}

// As on a full disk: what could not be finished is taken back.
TEST_F(CaseFolder, LeavesNoHalfOfACase) {
  auto table = metrology::Table::withColumns("points", std::array<std::string_view, 1>{"x_mm"});
  table.append({1});
  auto second = table;
  second.name = std::string(300, 'q');  // longer than the name of a file may be
  const Dataset dataset{.method = "sphere-fit", .config = {}, .tables = {table, second}};
  EXPECT_FALSE(writeCase(dataset, folder_ / "case").ok());
  EXPECT_TRUE(std::filesystem::is_empty(folder_ / "case"));
}

TEST_F(CaseFolder, OpensOnlyItsConfigurationAndItsTables) {
  const auto folder = goodCase("case");
  write("case/truth.json", "this is not JSON");
  write("case/notes.txt", "x,y\n1\n");
  EXPECT_TRUE(readCase(folder).ok());
}

// A pipe that nobody writes to would be read for ever.
TEST_F(CaseFolder, ReadsNoPipe) {
  for (const auto* name : {"config.json", "machine.csv"}) {
    const auto folder = goodCase(std::string{"case-"} + name);
    std::filesystem::remove(folder / name);
    ASSERT_EQ(mkfifo((folder / name).c_str(), 0600), 0);
    const auto read = readCase(folder);
    ASSERT_FALSE(read.ok());
    ASSERT_TRUE(std::holds_alternative<Unreadable>(read.error()));
    EXPECT_THAT(std::get<Unreadable>(read.error()).reason, HasSubstr(name));
  }
}

// A disk that fails was taken for an empty file.
TEST_F(CaseFolder, SaysWhichFileCannotBeRead) {
  for (const auto* name : {"config.json", "points.csv"}) {
    const auto folder = goodCase(std::string{"case-"} + name);
    std::filesystem::remove(folder / name);
    std::filesystem::create_symlink("/proc/self/mem", folder / name);
    const auto read = readCase(folder);
    ASSERT_FALSE(read.ok());
    ASSERT_TRUE(std::holds_alternative<Unreadable>(read.error()));
    const auto& reason = std::get<Unreadable>(read.error()).reason;
    EXPECT_THAT(reason, testing::AllOf(HasSubstr(name), testing::ContainsRegex("cannot (be )?read")));
  }
}

struct Named {
  std::string name;
  std::string text;
};

class UnreadableConfig : public ScratchFolder, public testing::WithParamInterface<Named> {};

TEST_P(UnreadableConfig, IsNoCase) {
  write("config.json", GetParam().text);
  const auto read = readCase(folder_);
  ASSERT_FALSE(read.ok());
  ASSERT_TRUE(std::holds_alternative<Unreadable>(read.error()));
  EXPECT_THAT(std::get<Unreadable>(read.error()).reason, HasSubstr("config.json"));
}

INSTANTIATE_TEST_SUITE_P(Texts, UnreadableConfig,
                         testing::Values(Named{"Empty", ""}, Named{"Cut", R"({"method": "sphere)"},
                                         Named{"NotANumber", R"({"method": "sphere-fit", "sigma_mm": NaN})"},
                                         Named{"List", "[]"}, Named{"NoMethod", "{}"},
                                         Named{"MethodIsANumber", R"({"method": 3})"},
                                         Named{"TwiceTheSameKey", R"({"method": "a", "sigma_mm": 1, "sigma_mm": 2})"}),
                         [](const auto& text) { return text.param.name; });

TEST_F(CaseFolder, MissingIsUnreadable) {
  const auto read = readCase(folder_ / "nowhere");
  ASSERT_FALSE(read.ok());
  EXPECT_TRUE(std::holds_alternative<Unreadable>(read.error()));
  EXPECT_TRUE(std::holds_alternative<Unreadable>(readCase(folder_).error()));
}

TEST_F(CaseFolder, NamesTheLineThatIsNoJson) {
  const auto reason = [&](const std::string& text) {
    write("config.json", text);
    const auto read = readCase(folder_);
    return read.ok() ? "read" : std::get<Unreadable>(read.error()).reason;
  };
  const auto line = [](int number) {
    return HasSubstr("config.json: not JSON at line " + std::to_string(number) + ": ");
  };
  EXPECT_THAT(reason("{\n \"method\": \"sphere-fit\",\n \"sigma_mm\": NaN\n}\n"), line(3));
  EXPECT_THAT(reason("{\n \"method\": \"sphere-fit\",\n \"sigma_mm\": NaN\n}\n"), HasSubstr("\"sigma_mm\": NaN"));
  EXPECT_THAT(reason("{\n \"method\": \"sphere\n}\n"), line(2)) << "the quote is missing at the end of the line";
  EXPECT_THAT(reason("{\n \"method\": \"sphere-fit\"\n"), HasSubstr("too early"));
  EXPECT_THAT(reason(""), line(1));
  EXPECT_THAT(reason("{\"a\": \x01\x1b}"), testing::Not(HasSubstr("\x1b"))) << "a terminal would obey it";
  for (const auto* text : {"", "{", "]", "{\"a\": 1e999}", "{\"a\": 1} x", "\xff\xfe", "{\"a\": \"\xff\"}"}) {
    EXPECT_THAT(reason(text), testing::Not(HasSubstr("json.exception"))) << text;
    EXPECT_NE(reason(text), "read") << text;
  }
}

TEST_F(CaseFolder, RefusesAConfigurationOfUnknownShape) {
  write("config.json", R"({"method": "sphere-fit", "sigma_mm": {"x": 1}})");
  const auto read = readCase(folder_);
  ASSERT_TRUE(std::holds_alternative<Unsupported>(read.error()));
  EXPECT_EQ(std::get<Unsupported>(read.error()).refusal.name, "bad-config");
}

struct BadText {
  std::string refusal;
  std::string text;
  std::string place;
};

class BadTable : public testing::TestWithParam<BadText> {};

TEST_P(BadTable, IsRefusedWithItsPlace) {
  const auto table = parseCsv(GetParam().text, "machine");
  ASSERT_FALSE(table.ok());
  EXPECT_EQ(table.error().front().name, GetParam().refusal);
  EXPECT_THAT(table.error().front().reason, HasSubstr("machine.csv" + GetParam().place));
}

INSTANTIATE_TEST_SUITE_P(Texts, BadTable,
                         testing::Values(BadText{"empty-file", "", ""}, BadText{"empty-file", "\n\n", ""},
                                         BadText{"truncated-file", "t_s,x_mm\n1,2\n3,4", ""},
                                         BadText{"bad-header", "1,2\n3,4\n", ", line 1, column 1"},
                                         BadText{"bad-header", "t_s,,x\n3,4,5\n", ", line 1, column 2"},
                                         BadText{"truncated-row", "t_s,x_mm\n1,2\n3\n5,6\n", ", line 3"},
                                         BadText{"truncated-row", "t_s,x_mm\n1,2\n\n5,6\n", ", line 3"},
                                         BadText{"extra-cells", "t_s,x_mm\n1,2\n3,4,5\n", ", line 3"},
                                         BadText{"not-a-number", "t_s,x_mm\n1,2\n3,4mm\n", ", line 3, column x_mm"},
                                         BadText{"not-a-number", "t_s,x_mm\n1,\n", ", line 2, column x_mm"},
                                         BadText{"not-finite", "t_s,x_mm\nnan,2\n", ", line 2, column t_s"},
                                         BadText{"not-finite", "t_s,x_mm\n1,inf\n", ", line 2, column x_mm"}));

TEST_F(CaseFolder, TellsAllItsProblemsAtOnce) {
  write("config.json", R"({"method": "sphere-fit", "sigma_mm": {}, "robust": null})");
  write("points.csv", "x_mm,y_mm,z_mm\n1,2,3mm\n4,5\nnan,oops,9\n");
  write("queries.csv", "");
  const auto read = readCase(folder_);
  ASSERT_FALSE(read.ok());
  ASSERT_TRUE(std::holds_alternative<Unsupported>(read.error()));
  const auto& [method, refusal] = std::get<Unsupported>(read.error());
  EXPECT_EQ(method, "sphere-fit");
  EXPECT_EQ(refusal.name, "bad-config") << "the first";
  for (const auto* problem : {"key 'sigma_mm'", "key 'robust'", "points.csv, line 2, column z_mm: '3mm'",
                              "points.csv, line 3: 2 cells", "not-finite: points.csv, line 4, column x_mm",
                              "points.csv, line 4, column y_mm: 'oops'", "queries.csv is empty"})
    EXPECT_THAT(refusal.reason, HasSubstr(problem));
  EXPECT_EQ(std::ranges::count(refusal.reason, '\n'), 6) << "one a line";
}

TEST_F(CaseFolder, TellsTheProblemsOfTablesBesideAConfigurationThatIsNone) {
  write("config.json", R"({"sigma_mm": 1, "sigma_mm": 2})");
  write("points.csv", "x_mm\none\n");
  const auto read = readCase(folder_);
  ASSERT_FALSE(read.ok());
  ASSERT_TRUE(std::holds_alternative<Unreadable>(read.error()));
  for (const auto* problem :
       {"'sigma_mm' is there twice: remove one", "names no method", "not-a-number: points.csv, line 2"})
    EXPECT_THAT(std::get<Unreadable>(read.error()).reason, HasSubstr(problem));
}

TEST_F(CaseFolder, TellsTheFirstOfVeryManyProblems) {
  write("config.json", R"({"method": "sphere-fit"})");
  std::string text = "x_mm\n";
  for (int row = 0; row < 1000; ++row) text += "no number\n";
  write("points.csv", text);
  const auto read = readCase(folder_);
  ASSERT_FALSE(read.ok());
  const auto& reason = std::get<Unsupported>(read.error()).refusal.reason;
  EXPECT_EQ(std::ranges::count(reason, '\n'), 20);
  EXPECT_THAT(reason, HasSubstr("and more"));
}

std::string utf16(std::string_view text, bool little) {
  std::string units = little ? "\xFF\xFE" : "\xFE\xFF";
  for (const char c : text) units += little ? std::string{c, '\0'} : std::string{'\0', c};
  return units;
}

TEST(GoodTable, MayBeInTheDialectsOfOthers) {
  const auto table = Table{.name = "points", .columns = {{"x_mm", {93.5, -4}}, {"y_mm", {2.25, 7}}}};
  const std::string rows = "93.5,2.25\n-4,7\n";
  for (const auto& text :
       {"x_mm,y_mm\n+93.5,+2.25\n-4,7\n",
        "x_mm,y_mm\n93.5,2.25\n\xE2\x88\x92"
        "4,7\n",
        "x_mm,y_mm\r93.5,2.25\r-4,7\r", "sep=,\nx_mm,y_mm\n93.5,2.25\n-4,7\n", "# x_mm,y_mm\n93.5,2.25\n-4,7\n",
        "# made by hand\n#\nx_mm,y_mm\n93.5,2.25\n-4,7\n", "# two comments\n# x_mm, y_mm\n93.5,2.25\n-4,7\n",
        "x_mm,y_mm,,\n93.5,2.25,,\n-4,7,,\n", "x_mm,y_mm\n93.5,2.25,\n-4,7,\n"}) {
    const auto read = parseCsv(text, "points");
    ASSERT_TRUE(read.ok()) << text << read.error().front().reason;
    EXPECT_EQ(*read, table) << text;
  }
  for (const bool little : {true, false}) {
    const auto read = parseCsv(utf16("x_mm,y_mm\r\n" + rows, little), "points");
    ASSERT_TRUE(read.ok()) << read.error().front().reason;
    EXPECT_EQ(*read, table);
  }
  EXPECT_EQ(parseCsv("sep=;\nx_mm;y_mm\n1;2\n", "points").error().front().name, "bad-header");
  EXPECT_EQ(parseCsv("x_mm,y_mm\n1,+-2\n", "points").error().front().name, "not-a-number");
  EXPECT_EQ(parseCsv("x_mm,y_mm\n1,2,,3\n", "points").error().front().name, "extra-cells");
}

TEST_F(CaseFolder, HasTablesWithNamesInCapitalsToo) {
  write("config.json", R"({"method": "sphere-fit"})");
  write("POINTS.CSV", "x_mm\n1\n");
  write("Queries.CSV", "x_mm\n2\n");
  const auto read = readCase(folder_);
  ASSERT_TRUE(read.ok());
  EXPECT_NE(read->table("points"), nullptr);
  EXPECT_NE(read->table("Queries"), nullptr);
  write("points.csv", "x_mm\n1\n");
  ASSERT_FALSE(readCase(folder_).ok()) << "which of the two";
}

// As a spreadsheet saves it as UTF-8.
TEST(GoodTable, MayBeginWithAByteOrderMarkAndHaveQuotes) {
  const auto table = parseCsv("\xEF\xBB\xBF\"C_rad\",x_mm\r\n0.5,\"2\"\r\n", "readings");
  ASSERT_TRUE(table.ok()) << table.error().front().reason;
  EXPECT_THAT(*table->column("C_rad"), testing::ElementsAre(0.5));
  EXPECT_THAT(*table->column("x_mm"), testing::ElementsAre(2.0));
}

TEST(SeparatedTable, IsToldOnceThatItsSeparatorIsToBeAComma) {
  const auto table = parseCsv("C_rad;x_mm;y_mm\n0;21,3;8,36\n0,5;21;8\n", "readings");
  ASSERT_FALSE(table.ok());
  ASSERT_EQ(table.error().size(), 1U);
  EXPECT_EQ(table.error().front().reason,
            "readings.csv, line 1: the columns are separated by semicolons; separate them by commas, and write numbers "
            "with a point, as 1.25");
  EXPECT_THAT(parseCsv("C_rad\tx_mm\n0\t2\n", "readings").error().front().reason, HasSubstr("tabs"));
}

TEST(GoodTable, MayHaveBlanksCarriageReturnsAndEmptyLinesAtTheEnd) {
  const auto table = parseCsv("t_s, x_mm\r\n1,\t2\r\n-3e-3 , 4\r\n\r\n", "machine");
  ASSERT_TRUE(table.ok()) << table.error().front().reason;
  EXPECT_THAT(*table->column("t_s"), testing::ElementsAre(1.0, -0.003));
  EXPECT_THAT(*table->column("x_mm"), testing::ElementsAre(2.0, 4.0));
}

}  // namespace
}  // namespace probebox::casefolder
