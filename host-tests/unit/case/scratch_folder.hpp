#pragma once
#include <filesystem>
#include <fstream>
#include <gtest/gtest.h>
#include <string>

#include "host-tests/support/temporary_folder.hpp"

namespace probebox::casefolder {

// A folder of its own for every test, gone when the test is.
class ScratchFolder : public testing::Test {
 protected:
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

  const support::TemporaryFolder scratch_;
  const std::filesystem::path folder_ = scratch_.path();
};

}  // namespace probebox::casefolder
