#include "warp/warp.h"

#include "warp/deform_kernels.h"

#include <cassert>
#include <cmath>
#include <numbers>

namespace surflect::warp {

void Warp::carry(WarpBatch& b) const {
  for (int i = 0; i < b.count; ++i) {
    const Vec3<double> x(b.x[i], b.y[i], b.z[i]);
    const auto j = jacobian(x);
    assert(j);
    const Vec3<double> p = position(x);
    const Vec3<double> u = *j * Vec3<double>(b.ux[i], b.uy[i], b.uz[i]);
    const Vec3<double> v = *j * Vec3<double>(b.vx[i], b.vy[i], b.vz[i]);
    b.x[i] = p.x(), b.y[i] = p.y(), b.z[i] = p.z();
    b.ux[i] = u.x(), b.uy[i] = u.y(), b.uz[i] = u.z();
    b.vx[i] = v.x(), b.vy[i] = v.y(), b.vz[i] = v.z();
    b.determinant[i] *= j->determinant();
  }
}

Mat3<double> centralDifferences(const Warp& warp, const Vec3<double>& x, const Mat3<double>& directions,
                                double epsilon) {
  Mat3<double> derivatives;
  for (int i = 0; i < 3; ++i) {
    const Vec3<double> offset = epsilon * directions.col(i);
    derivatives.col(i) = (warp.position(x + offset) - warp.position(x - offset)) / (2 * epsilon);
  }
  return derivatives;
}

namespace {

[[maybe_unused]] bool isUnit(const Vec3<double>& v) { return std::abs(v.squaredNorm() - 1) < 1e-9; }

Mat3<double> turn(const Vec3<double>& axis, double radians) {
  return Eigen::AngleAxisd(radians, axis).toRotationMatrix();
}

// sin(x) / x
double sinc(double x) { return std::abs(x) < 1e-4 ? 1 - x * x / 6 : std::sin(x) / x; }

// Psi(x) = A x + b,  J = A
class Affine final : public Warp {
public:
  Affine(const Mat3<double>& linear, const Vec3<double>& offset) : linear_(linear), offset_(offset) {}
  Vec3<double> position(const Vec3<double>& x) const override { return linear_ * x + offset_; }
  std::optional<Mat3<double>> jacobian(const Vec3<double>&) const override { return linear_; }
  void carry(WarpBatch& batch) const override {
    carryAffine(linear_.data(), offset_.data(), linear_.determinant(), batch);
  }

private:
  Mat3<double> linear_;
  Vec3<double> offset_;
};

// With h = a . (x - c) and R = Rot(a, k h):
//   Psi(x) = c + R (x - c)
//   J      = R + k (a x R (x - c)) a^T
class Twist final : public Warp {
public:
  Twist(const Vec3<double>& axis, double k, const Vec3<double>& center)
      : axis_(axis), k_(k), center_(center) {}

  Vec3<double> position(const Vec3<double>& x) const override { return center_ + turnAt(x) * (x - center_); }
  std::optional<Mat3<double>> jacobian(const Vec3<double>& x) const override {
    const Mat3<double> r = turnAt(x);
    return r + k_ * axis_.cross(r * (x - center_)) * axis_.transpose();
  }
  void carry(WarpBatch& batch) const override { carryTwist(axis_.data(), k_, center_.data(), batch); }

private:
  Mat3<double> turnAt(const Vec3<double>& x) const { return turn(axis_, k_ * axis_.dot(x - center_)); }

  Vec3<double> axis_;
  double k_; // radians per unit
  Vec3<double> center_;
};

// With h = a . (x - c), w = d . (x - c), m = a x d, phi = k h, and on the circle
//   T = cos(phi) a + sin(phi) d,  N = -sin(phi) a + cos(phi) d   tangent, normal
//   S = h (sinc(phi) a + sin(phi/2) sinc(phi/2) d)               arc from the centre, dS/dh = T:
//   Psi(x) = c + S + w N + (m . (x - c)) m
//   J      = (1 - k w) T a^T + N d^T + m m^T
class Bend final : public Warp {
public:
  Bend(const Vec3<double>& axis, const Vec3<double>& direction, double k, const Vec3<double>& center)
      : a_(axis), d_(direction), m_(axis.cross(direction)), k_(k), center_(center) {}

  Vec3<double> position(const Vec3<double>& x) const override {
    const Vec3<double> y = x - center_;
    const double h = a_.dot(y), w = d_.dot(y), phi = k_ * h;
    const Vec3<double> arc = h * (sinc(phi) * a_ + std::sin(phi / 2) * sinc(phi / 2) * d_);
    return center_ + arc + w * normal(phi) + m_.dot(y) * m_;
  }
  std::optional<Mat3<double>> jacobian(const Vec3<double>& x) const override {
    const Vec3<double> y = x - center_;
    const double w = d_.dot(y), phi = k_ * a_.dot(y);
    const Vec3<double> tangent = std::cos(phi) * a_ + std::sin(phi) * d_;
    return (1 - k_ * w) * tangent * a_.transpose() + normal(phi) * d_.transpose() + m_ * m_.transpose();
  }
  void carry(WarpBatch& batch) const override {
    if (std::isfinite(1 / k_)) // else it is straight
      carryBend(a_.data(), d_.data(), k_, center_.data(), batch);
  }

private:
  Vec3<double> normal(double phi) const { return -std::sin(phi) * a_ + std::cos(phi) * d_; }

  Vec3<double> a_, d_, m_;
  double k_; // radians per unit of arc
  Vec3<double> center_;
};

// With h = a . (x - c), q = x - c - h a and s = exp(g h):
//   Psi(x) = c + h a + s q
//   J      = a a^T + s (I - a a^T) + g s q a^T
class Taper final : public Warp {
public:
  Taper(const Vec3<double>& axis, double g, const Vec3<double>& center)
      : axis_(axis), g_(g), center_(center) {}

  Vec3<double> position(const Vec3<double>& x) const override {
    const double h = heightOf(x);
    return center_ + h * axis_ + std::exp(g_ * h) * across(x, h);
  }
  std::optional<Mat3<double>> jacobian(const Vec3<double>& x) const override {
    const double h = heightOf(x), s = std::exp(g_ * h);
    const Mat3<double> along = axis_ * axis_.transpose();
    return along + s * (Mat3<double>::Identity() - along) + g_ * s * across(x, h) * axis_.transpose();
  }
  void carry(WarpBatch& batch) const override { carryTaper(axis_.data(), g_, center_.data(), batch); }

private:
  double heightOf(const Vec3<double>& x) const { return axis_.dot(x - center_); }
  Vec3<double> across(const Vec3<double>& x, double h) const { return x - center_ - h * axis_; }

  Vec3<double> axis_;
  double g_; // per unit
  Vec3<double> center_;
};

// With q = 2 pi / wavelength and phi = q a . (x - c) + phase:
//   Psi(x) = x + A sin(phi) d
//   J      = I + A q cos(phi) d a^T
class Sine final : public Warp {
public:
  explicit Sine(const SineWave& wave) : wave_(wave), q_(2 * std::numbers::pi / wave.wavelength) {}

  Vec3<double> position(const Vec3<double>& x) const override {
    return x + wave_.amplitude * std::sin(phaseAt(x)) * wave_.direction;
  }
  std::optional<Mat3<double>> jacobian(const Vec3<double>& x) const override {
    return Mat3<double>::Identity() +
           wave_.amplitude * q_ * std::cos(phaseAt(x)) * wave_.direction * wave_.axis.transpose();
  }
  void carry(WarpBatch& batch) const override {
    carrySine(wave_.axis.data(), wave_.direction.data(), wave_.center.data(), wave_.amplitude, q_,
              wave_.phase.radians(), batch);
  }

private:
  double phaseAt(const Vec3<double>& x) const {
    return q_ * wave_.axis.dot(x - wave_.center) + wave_.phase.radians();
  }

  SineWave wave_;
  double q_;
};

class Formula final : public Warp {
public:
  Formula(Expression x, Expression y, Expression z, const ShotTime& time, const Vec3<double>& origin)
      : coordinates_{std::move(x), std::move(y), std::move(z)}, time_(time), origin_(origin) {}

  Vec3<double> position(const Vec3<double>& x) const override {
    const Vec3<double> y = x + origin_;
    const std::array values{y[0], y[1], y[2], time_.t, time_.frame, time_.s};
    return Vec3<double>(coordinates_[0](values), coordinates_[1](values), coordinates_[2](values)) - origin_;
  }
  std::optional<Mat3<double>> jacobian(const Vec3<double>&) const override { return std::nullopt; }

private:
  std::array<Expression, 3> coordinates_;
  ShotTime time_;
  Vec3<double> origin_;
};

class Chain final : public Warp {
public:
  explicit Chain(std::vector<WarpPointer> links) : links_(std::move(links)) {}

  Vec3<double> position(const Vec3<double>& x) const override {
    Vec3<double> y = x;
    for (const WarpPointer& link : links_) y = link->position(y);
    return y;
  }
  std::optional<Mat3<double>> jacobian(const Vec3<double>& x) const override {
    Vec3<double> y = x;
    Mat3<double> product = Mat3<double>::Identity();
    for (const WarpPointer& link : links_) {
      const auto factor = link->jacobian(y);
      if (!factor) return std::nullopt;
      product = *factor * product;
      y = link->position(y);
    }
    return product;
  }
  void carry(WarpBatch& batch) const override {
    for (const WarpPointer& link : links_) link->carry(batch);
  }

private:
  std::vector<WarpPointer> links_;
};

} // namespace

WarpPointer rigidWarp(const Vec3<double>& axis, Angle angle, const Vec3<double>& center,
                      const Vec3<double>& translation) {
  assert(isUnit(axis));
  const Mat3<double> r = turn(axis, angle.radians());
  return std::make_unique<Affine>(r, center - r * center + translation);
}

WarpPointer scaleWarp(const Vec3<double>& factors, const Vec3<double>& center) {
  return std::make_unique<Affine>(factors.asDiagonal(), center - factors.cwiseProduct(center));
}

WarpPointer twistWarp(const Vec3<double>& axis, Angle anglePerUnit, const Vec3<double>& center) {
  assert(isUnit(axis));
  return std::make_unique<Twist>(axis, anglePerUnit.radians(), center);
}

WarpPointer bendWarp(const Vec3<double>& axis, const Vec3<double>& direction, Angle anglePerUnit,
                     const Vec3<double>& center) {
  assert(isUnit(axis) && isUnit(direction) && std::abs(axis.dot(direction)) < 1e-9);
  return std::make_unique<Bend>(axis, direction, anglePerUnit.radians(), center);
}

WarpPointer taperWarp(const Vec3<double>& axis, double growthPerUnit, const Vec3<double>& center) {
  assert(isUnit(axis));
  return std::make_unique<Taper>(axis, growthPerUnit, center);
}

WarpPointer sineWarp(const SineWave& wave) {
  assert(isUnit(wave.axis) && isUnit(wave.direction) && wave.wavelength != 0);
  return std::make_unique<Sine>(wave);
}

WarpPointer expressionWarp(Expression x, Expression y, Expression z, const ShotTime& time,
                           const Vec3<double>& origin) {
  return std::make_unique<Formula>(std::move(x), std::move(y), std::move(z), time, origin);
}

WarpPointer chainWarp(std::vector<WarpPointer> links) { return std::make_unique<Chain>(std::move(links)); }

} // namespace surflect::warp
