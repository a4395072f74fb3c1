#include "drivers/world/route.hpp"

#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>

#include "drivers/world/random.hpp"

namespace probebox::world {
namespace {

constexpr Vector3 kCentre{10, -20, 30};
constexpr double kKeepOut = 17.5;

double closest(const Vector3& a, const Vector3& b) {
  const Vector3 ab = b - a;
  const double at = std::clamp(dot(kCentre - a, ab) / dot(ab, ab), 0.0, 1.0);
  return norm(a + at * ab - kCentre);
}

// The nearest that the path comes to the centre on its way between leaving the start and reaching the target.
void expectClear(const Vector3& start, const Vector3& target) {
  SafePath path{start, target, kCentre, kKeepOut};
  ASSERT_FALSE(path.done());
  Vector3 at = start;
  std::size_t passed = 0;
  while (!path.done()) {
    const Vector3 to = path.next();
    path.pass();
    const bool leaves = passed == 0, arrives = path.done();
    const double allowed = leaves    ? std::min(kKeepOut, norm(start - kCentre))
                           : arrives ? std::min(kKeepOut, norm(target - kCentre))
                                     : kKeepOut;
    if (at != to) {
      ASSERT_GE(closest(at, to), allowed - 1e-9);
    }
    at = to;
    ++passed;
  }
  EXPECT_EQ(at, target);
}

TEST(SafePath, KeepsOutOfTheSphereFromAnywhereToAnywhere) {
  Random random{5, 1};
  for (int i = 0; i < 5000; ++i) {
    const auto place = [&] {
      return kCentre + random.uniform(16, 90) * unit({random.normal(), random.normal(), random.normal()});
    };
    expectClear(place(), place());
  }
}

TEST(SafePath, CrossesBetweenOppositeSidesOverTheTop) {
  for (const Vector3& side : {Vector3{1, 0, 0}, {0, 1, 0}, unit({1, 1, 0}), unit({1, -1, 0.2})}) {
    const Vector3 start = kCentre + 16.1 * side, target = kCentre - 16.1 * side;
    expectClear(start, target);
    double highest = -100;
    for (SafePath path{start, target, kCentre, kKeepOut}; !path.done(); path.pass()) {
      highest = std::max(highest, path.next()[2]);
    }
    EXPECT_GT(highest, kCentre[2] + kKeepOut);
  }
}

TEST(SafePath, ReachesTheSidesBelowToo) {
  expectClear(kCentre + Vector3{0, 0, 80}, kCentre + Vector3{0, 0, -16.1});
  expectClear(kCentre + Vector3{0, 0, -16.1}, kCentre + Vector3{0, 0, 80});
}

TEST(SafePath, IsEmptyWhenAlreadyThere) {
  const Vector3 here = kCentre + Vector3{16.1, 0, 0};
  EXPECT_TRUE((SafePath{here, here, kCentre, kKeepOut}.done()));
}

}  // namespace
}  // namespace probebox::world
