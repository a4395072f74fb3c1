// A swivelling head read with tools that are longer than their lengths say.
#include <array>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <string>

#include "host-tests/metrology/swivelling_head.hpp"

namespace probebox::metrology {
namespace {

using Eigen::Vector3d;

// A tool that is longer than its length says moves the report as an error of the head does.
TEST(LengthsOfTools, AreInTheUncertaintyOfASwivelError) {
  std::mt19937_64 random{51};
  const std::array<const char*, 3> axes{"x_mm", "y_mm", "z_mm"};
  const std::array<double, 2> lengths{100, 200}, sds{0.003, 0.001};
  Moments pull;
  for (int trial = 0; trial < 400; ++trial) {
    Head head = randomHead(random);
    head.axis = Vector3d::Zero();
    head.axis[trial % 2] = trial % 4 < 2 ? 1.0 : -1.0;
    head.skew -= head.axis * head.axis.dot(head.skew);
    Dataset dataset = swivelDataset(head, {-90, -45, 0, 45, 90}, {lengths[0], lengths[1]}, 0.0004, random);
    for (std::size_t tool = 0; tool < lengths.size(); ++tool) {
      Head longer = head;
      longer.gauge.z() += gauss(random, sds[tool]);
      const auto& b = columnNamed(dataset, "readings", "B_deg");
      const auto& of = columnNamed(dataset, "readings", "L_mm");
      for (std::size_t row = 0; row < b.size(); ++row) {
        if (of[row] != lengths[tool]) continue;
        const Vector3d more = longer.reported(b[row], lengths[tool]) - head.reported(b[row], lengths[tool]);
        for (Eigen::Index k = 0; k < 3; ++k)
          columnNamed(dataset, "readings", axes[static_cast<std::size_t>(k)])[row] += more[k];
      }
      dataset.config["sd_length_" + std::to_string(tool + 1) + "_mm"] = sds[tool];
    }
    const auto solved = solve(dataset);
    ASSERT_TRUE(solved.ok()) << solved.error().reason;
    EXPECT_THAT(solved->warnings, testing::IsEmpty());
    Result combined = solved.value();
    for (auto& estimate : combined.estimates) estimate.sd = estimate.uncertainty;
    addErrors(pull, combined, head);
    EXPECT_THAT(solved->budget, testing::Contains(testing::Field(&Contribution::name, "sd_length_2_mm")));
  }
  expectHonest(pull, 2 * 400);  // two lengths move all errors of a fit
}

TEST(LengthsOfTools, AreRefusedWhereTheyWereNotRead) {
  std::mt19937_64 random{52};
  Dataset dataset = swivelDataset({}, {-90, -45, 0, 45, 90}, {100, 200}, 0.001, random);
  dataset.config["sd_length_3_mm"] = 0.002;
  EXPECT_EQ(refusalOf(dataset), "missing-key");
}

}  // namespace
}  // namespace probebox::metrology
