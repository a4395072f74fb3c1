#pragma once
#include <array>
#include <cmath>
#include <cstddef>

// The little algebra of three axes that an emulated machine needs.
namespace probebox::world {

using Vector3 = std::array<double, 3>;
using Matrix3 = std::array<Vector3, 3>;  // rows

constexpr Vector3 operator+(const Vector3& a, const Vector3& b) {
  return {a[0] + b[0], a[1] + b[1], a[2] + b[2]};
}
constexpr Vector3 operator-(const Vector3& a, const Vector3& b) {
  return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}
constexpr Vector3 operator-(const Vector3& a) {
  return {-a[0], -a[1], -a[2]};
}
constexpr Vector3 operator*(double factor, const Vector3& a) {
  return {factor * a[0], factor * a[1], factor * a[2]};
}

constexpr double dot(const Vector3& a, const Vector3& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}
inline double norm(const Vector3& a) {
  return std::sqrt(dot(a, a));
}

// The zero vector for a vector without a direction.
inline Vector3 unit(const Vector3& a) {
  const double length = norm(a);
  return length > 0 ? (1 / length) * a : Vector3{};
}

constexpr Vector3 cross(const Vector3& a, const Vector3& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

constexpr Vector3 operator*(const Matrix3& m, const Vector3& a) {
  return {dot(m[0], a), dot(m[1], a), dot(m[2], a)};
}

// Of a matrix that has one: a gain matrix far from singular.
constexpr Matrix3 inverse(const Matrix3& m) {
  const Vector3 a = cross(m[1], m[2]), b = cross(m[2], m[0]), c = cross(m[0], m[1]);
  const double scale = 1 / dot(m[0], a);
  return {{{scale * a[0], scale * b[0], scale * c[0]},
           {scale * a[1], scale * b[1], scale * c[1]},
           {scale * a[2], scale * b[2], scale * c[2]}}};
}

}  // namespace probebox::world
