// Headless OpenGL 4.5 core through EGL: on a GPU where there is one, on Mesa's llvmpipe elsewhere.
//
// A context is current on the thread that made it. The other objects of this folder belong to it: they are
// made, used and destroyed on that thread, and do not outlive it.
//
// Conventions of all contexts:
//   pixels   row 0 is the top of the picture, in textures and framebuffers; gl_FragCoord.xy is a
//            capture::Pixel
//   depth    0 at the near plane, 1 at the far plane
//   colours  linear; an sRGB texture encodes and decodes them
#pragma once

#include "surfel/base/time.h"

#include <memory>
#include <string>

namespace surflect::gl {

struct ContextOptions {
  // Uses Mesa's software renderer even if there is a GPU. Its pixels depend on Mesa's version and on the
  // processor's instructions, but not on the number of threads (environment variable LP_NUM_THREADS).
  bool software = false;
};

struct Limits {
  int textureSize = 0;  // largest width and height
  int arrayLayers = 0;  // most layers of an array texture
  int textureUnits = 0; // per fragment shader
  int colorAttachments = 0;
};

struct Description {
  std::string renderer, version, vendor;
  Limits limits;
};

class Context {
public:
  // Throws Error if there is no EGL, no driver, or no OpenGL 4.5; and where a limit of the address space
  // (ulimit -v) leaves too little. Needs a thread without a current context.
  explicit Context(const ContextOptions& options = {});
  ~Context();
  Context(const Context&) = delete;
  Context& operator=(const Context&) = delete;

  const Description& describe() const;
  // "driver NAME VERSION", for identities of frames.
  std::string driver() const;

private:
  struct State;
  std::unique_ptr<State> state_;
};

// Context of this thread that all holders share, made where there is none: a thread has only one current
// context. Throws Error as Context does, and if the thread has a context that was made otherwise.
std::shared_ptr<const Context> contextOfThread();

// Throws Error with the first error or undefined behaviour that OpenGL reported since the last call, and
// where a limit of the address space leaves too little for drawing. Every constructor, read-back and finish()
// ends with it.
void requireNoErrors();

// Waits until all commands have run.
void finish();

// Elapsed time since construction, all commands included. OpenGL's own timer queries are not used: llvmpipe's
// leave out most of the work.
class Stopwatch {
public:
  Stopwatch() { finish(), stopwatch_ = {}; }
  double seconds() const {
    finish();
    return stopwatch_.seconds();
  }

private:
  surflect::Stopwatch stopwatch_;
};

} // namespace surflect::gl
