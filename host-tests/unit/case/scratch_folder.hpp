#pragma once
#include <filesystem>
#include <fstream>
#include <gtest/gtest.h>
#include <string>

namespace probebox::casefolder {

// A folder of its own for every test, gone when the test is.
class ScratchFolder : public testing::Test {
 protected:
  ScratchFolder() {
    const auto* test = testing::UnitTest::GetInstance()->current_test_info();
    folder_ = std::filesystem::path{testing::TempDir()} / "probebox-case" /
              (std::string{test->test_suite_name()} + "." + test->name());
    std::filesystem::remove_all(folder_);
    std::filesystem::create_directories(folder_);
  }
  ~ScratchFolder() override { std::filesystem::remove_all(folder_); }

  // A case "sphere-fit" of five good points.
  std::filesystem::path goodCase(const std::string& name) const {
    write(name + "/config.json", R"({"method": "sphere-fit", "sigma_mm": 0.001})");
    write(name + "/points.csv", "x_mm,y_mm,z_mm\n10,0,0\n-10,0,0\n0,10,0\n0,-10,0\n0,0,10.0005\n");
    return folder_ / name;
  }
  void write(const std::filesystem::path& name, const std::string& text) const {
    std::filesystem::create_directories((folder_ / name).parent_path());
    std::ofstream{folder_ / name, std::ios::binary} << text;
  }

  std::filesystem::path folder_;
};

}  // namespace probebox::casefolder
