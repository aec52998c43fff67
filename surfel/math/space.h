// Points, directions and normals that carry their space in their type, so that mixing spaces does not
// compile.
//
//   AcquisitionSpace  where the photographs were taken
//   ObjectSpace       after the warp: the world of the script
//   CameraSpace       x right, y up, looking along -z
//   EnvironmentSpace  of an environment map: y is up, its middle lies on -z with x to the right
//
// A Triple is three bare scalars; algebra uses Eigen vectors through raw().
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <array>
#include <numbers>
#include <type_traits>

namespace surflect {

struct AcquisitionSpace;
struct ObjectSpace;
struct CameraSpace;
struct EnvironmentSpace;

template <class T> using Vec2 = Eigen::Matrix<T, 2, 1>;
template <class T> using Vec3 = Eigen::Matrix<T, 3, 1>;
template <class T> using Mat3 = Eigen::Matrix<T, 3, 3>;

struct PointKind;
struct DirectionKind;
struct NormalKind;

template <class Kind, class Space, class T> class Triple {
public:
  using Scalar = T;

  Triple() = default;
  constexpr Triple(T x, T y, T z) : x_(x), y_(y), z_(z) {}

  T x() const { return x_; }
  T y() const { return y_; }
  T z() const { return z_; }

  // Leaves the type system. Use it for algebra inside one function, and at file, Embree and GL edges.
  Vec3<T> raw() const { return {x_, y_, z_}; }

  template <class U> Triple<Kind, Space, U> cast() const {
    return {static_cast<U>(x_), static_cast<U>(y_), static_cast<U>(z_)};
  }

  friend bool operator==(const Triple&, const Triple&) = default;

private:
  T x_{}, y_{}, z_{};
};

template <class Space, class T = float> using Point3 = Triple<PointKind, Space, T>;
template <class Space, class T = float> using Direction3 = Triple<DirectionKind, Space, T>;
template <class Space, class T = float> using Normal3 = Triple<NormalKind, Space, T>;

// Enters the type system: the caller guarantees kind and space.
template <class Typed, class Derived> Typed assume(const Eigen::MatrixBase<Derived>& v) {
  using T = typename Typed::Scalar;
  return {static_cast<T>(v[0]), static_cast<T>(v[1]), static_cast<T>(v[2])};
}

template <class S, class T> Direction3<S, T> operator-(const Point3<S, T>& a, const Point3<S, T>& b) {
  return {a.x() - b.x(), a.y() - b.y(), a.z() - b.z()};
}
template <class S, class T> Point3<S, T> operator+(const Point3<S, T>& p, const Direction3<S, T>& d) {
  return {p.x() + d.x(), p.y() + d.y(), p.z() + d.z()};
}
template <class S, class T> Direction3<S, T> operator+(const Direction3<S, T>& a, const Direction3<S, T>& b) {
  return {a.x() + b.x(), a.y() + b.y(), a.z() + b.z()};
}
template <class S, class T> Direction3<S, T> operator-(const Direction3<S, T>& d) {
  return {-d.x(), -d.y(), -d.z()};
}
template <class S, class T> Direction3<S, T> operator*(T s, const Direction3<S, T>& d) {
  return {s * d.x(), s * d.y(), s * d.z()};
}

template <class S, class T> T dot(const Direction3<S, T>& a, const Direction3<S, T>& b) {
  return a.raw().dot(b.raw());
}
template <class S, class T> T dot(const Normal3<S, T>& a, const Direction3<S, T>& b) {
  return a.raw().dot(b.raw());
}
template <class S, class T> T length(const Direction3<S, T>& d) { return d.raw().norm(); }

// Unit vector; the length must be neither zero nor infinite.
template <class S, class T> Direction3<S, T> normalized(const Direction3<S, T>& d) {
  return assume<Direction3<S, T>>(d.raw() / d.raw().norm());
}

static_assert(sizeof(Point3<ObjectSpace>) == 3 * sizeof(float));
static_assert(std::is_trivially_copyable_v<Point3<ObjectSpace>>);

// x -> rotation x + translation, named target-from-source: Rigid<CameraSpace, ObjectSpace> cameraFromObject.
template <class To, class From, class T = double> class Rigid {
public:
  Rigid() = default;
  Rigid(const Mat3<T>& rotation, const Vec3<T>& translation)
      : rotation_(rotation), translation_(translation) {}

  const Mat3<T>& rotation() const { return rotation_; }
  const Vec3<T>& translation() const { return translation_; }

  template <class U> Point3<To, U> operator()(const Point3<From, U>& p) const {
    return assume<Point3<To, U>>(rotation_ * p.raw().template cast<T>() + translation_);
  }
  template <class U> Direction3<To, U> operator()(const Direction3<From, U>& d) const {
    return assume<Direction3<To, U>>(rotation_ * d.raw().template cast<T>());
  }

  Rigid<From, To, T> inverse() const {
    return {rotation_.transpose(), -(rotation_.transpose() * translation_)};
  }

private:
  Mat3<T> rotation_ = Mat3<T>::Identity();
  Vec3<T> translation_ = Vec3<T>::Zero();
};

template <class A, class B, class C, class T>
Rigid<A, C, T> operator*(const Rigid<A, B, T>& aFromB, const Rigid<B, C, T>& bFromC) {
  return {aFromB.rotation() * bFromC.rotation(),
          aFromB.rotation() * bFromC.translation() + aFromB.translation()};
}

// Rotation of directions, or rotation and reflection; named target-from-source.
template <class To, class From, class T = double> class Rotation {
public:
  // Stored as bare scalars, so that arrays can be copied as bytes.
  explicit Rotation(const Mat3<T>& orthogonal = Mat3<T>::Identity()) {
    Eigen::Map<Mat3<T>>(matrix_.data()) = orthogonal;
  }

  Mat3<T> matrix() const { return Eigen::Map<const Mat3<T>>(matrix_.data()); }

  template <class U> Direction3<To, U> operator()(const Direction3<From, U>& d) const {
    return assume<Direction3<To, U>>(Eigen::Map<const Mat3<T>>(matrix_.data()) * d.raw().template cast<T>());
  }

  template <class U> Rotation<To, From, U> cast() const {
    return Rotation<To, From, U>(matrix().template cast<U>());
  }

private:
  std::array<T, 9> matrix_;
};

template <class A, class B, class C, class T>
Rotation<A, C, T> operator*(const Rotation<A, B, T>& aFromB, const Rotation<B, C, T>& bFromC) {
  return Rotation<A, C, T>(aFromB.matrix() * bFromC.matrix());
}

// Angle type: radians inside, degrees only at input and output.
class Angle {
public:
  Angle() = default;
  static constexpr Angle fromRadians(double radians) { return Angle(radians); }
  static constexpr Angle fromDegrees(double degrees) { return Angle(degrees * std::numbers::pi / 180); }

  constexpr double radians() const { return radians_; }
  constexpr double degrees() const { return radians_ * 180 / std::numbers::pi; }

private:
  explicit constexpr Angle(double radians) : radians_(radians) {}
  double radians_ = 0;
};

// Nearest rotation to a matrix with rounded digits.
// [Higham 1986] Higham: Computing the polar decomposition with applications, SIAM J. Sci. Stat. Comput. 7(4).
// [Bjorck 1971] Bjorck, Bowie: An iterative algorithm for computing the best estimate of an orthogonal
// matrix, SIAM J. Numer. Anal. 8(2).

// Orthogonal polar factor of a matrix whose entries are within 0.01 of a rotation's  [Higham 1986].
inline Mat3<double> nearestRotation(const Mat3<double>& matrix) {
  Mat3<double> q = matrix;
  // q <- q (3 - q^T q) / 2 squares the distance [Bjorck 1971].
  for (int step = 0; step < 5; ++step)
    q = 0.5 * q * (3 * Mat3<double>::Identity() - q.transpose() * q).eval();
  return q;
}

} // namespace surflect
