#include "render/gl/context.h"

#include "surfel/base/error.h"

// Keeps X11's macros out.
#define EGL_NO_X11
#define MESA_EGL_NO_X11_HEADERS
#include <dlfcn.h>
#include <epoxy/egl.h>
#include <epoxy/gl.h>
#include <sys/mman.h>
#include <sys/resource.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <optional>
#include <string_view>
#include <vector>

namespace surflect::gl {

namespace {

constexpr size_t kKeptMessages = 16;

// "OpenGL: FIELD: found ..., expected ..."; the field is added by at().
Error mismatch(std::string_view expected, std::string_view found) {
  return Error::mismatch(expected, found).in("OpenGL");
}

// libepoxy ends the process if it cannot open a library.
void requireLibrary(const char* name, const char* package) {
  if (!dlopen(name, RTLD_LAZY | RTLD_LOCAL))
    throw mismatch("the library (Debian: " + std::string(package) + ")", "nothing").at(name);
}

bool has(const char* extensions, std::string_view name) {
  const std::string_view all = extensions ? extensions : "";
  for (size_t at = all.find(name); at != all.npos; at = all.find(name, at + 1)) {
    const size_t end = at + name.size();
    if ((at == 0 || all[at - 1] == ' ') && (end == all.size() || all[end] == ' ')) return true;
  }
  return false;
}

// Displays to try, in order: GPUs, then Mesa's software renderer.
std::vector<EGLDisplay> displays(bool software) {
  const char* extensions = eglQueryString(EGL_NO_DISPLAY, EGL_EXTENSIONS);
  std::vector<EGLDisplay> gpus, inSoftware;
  if (has(extensions, "EGL_EXT_device_enumeration") && has(extensions, "EGL_EXT_platform_device")) {
    std::array<EGLDeviceEXT, 64> devices{};
    EGLint count = 0;
    eglQueryDevicesEXT(static_cast<EGLint>(devices.size()), devices.data(), &count);
    for (EGLint i = 0; i < count; ++i) {
      const bool isSoftware =
          has(eglQueryDeviceStringEXT(devices[i], EGL_EXTENSIONS), "EGL_MESA_device_software");
      (isSoftware ? inSoftware : gpus)
          .push_back(eglGetPlatformDisplayEXT(EGL_PLATFORM_DEVICE_EXT, devices[i], nullptr));
    }
  }
  // Mesa without device enumeration.
  if (inSoftware.empty() && has(extensions, "EGL_MESA_platform_surfaceless"))
    inSoftware.push_back(eglGetPlatformDisplayEXT(EGL_PLATFORM_SURFACELESS_MESA, nullptr, nullptr));
  if (software) return inSoftware;
  gpus.insert(gpus.end(), inSoftware.begin(), inSoftware.end());
  return gpus;
}

// Context of the given version; without one, of whatever version the driver offers.
EGLContext contextOf(EGLDisplay display, bool isNewEnough) {
  constexpr std::array<EGLint, 9> kCore45{EGL_CONTEXT_MAJOR_VERSION,
                                          4,
                                          EGL_CONTEXT_MINOR_VERSION,
                                          5,
                                          EGL_CONTEXT_OPENGL_PROFILE_MASK,
                                          EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT,
                                          EGL_CONTEXT_OPENGL_DEBUG,
                                          EGL_TRUE,
                                          EGL_NONE};
  constexpr std::array<EGLint, 1> kAny{EGL_NONE};
  return eglCreateContext(display, EGL_NO_CONFIG_KHR, EGL_NO_CONTEXT,
                          isNewEnough ? kCore45.data() : kAny.data());
}

std::string text(GLenum name) {
  const auto* bytes = reinterpret_cast<const char*>(glGetString(name));
  return bytes ? bytes : "";
}

int number(GLenum name) {
  GLint value = 0;
  glGetIntegerv(name, &value);
  return value;
}

// Version and renderer of a display that has no context of version 4.5; empty if it has none at all.
std::optional<std::string> olderVersion(EGLDisplay display) {
  EGLContext context = contextOf(display, false);
  if (context == EGL_NO_CONTEXT) return std::nullopt;
  std::optional<std::string> found;
  if (eglMakeCurrent(display, EGL_NO_SURFACE, EGL_NO_SURFACE, context)) {
    found = text(GL_VERSION) + " (" + text(GL_RENDERER) + ")";
    eglMakeCurrent(display, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
  }
  eglDestroyContext(display, context);
  return found;
}

using Messages = std::vector<std::string>;

// Called within the faulty command.
void GLAPIENTRY collect(GLenum source, GLenum type, GLuint, GLenum, GLsizei length, const GLchar* message,
                        const void* user) {
  if (type != GL_DEBUG_TYPE_ERROR && type != GL_DEBUG_TYPE_UNDEFINED_BEHAVIOR) return;
  if (source == GL_DEBUG_SOURCE_SHADER_COMPILER) return; // Program reports these with their file
  auto& messages = *static_cast<Messages*>(const_cast<void*>(user));
  if (messages.size() < kKeptMessages) messages.emplace_back(message, static_cast<size_t>(length));
}

void collectErrors(Messages& messages) {
  glEnable(GL_DEBUG_OUTPUT);
  glEnable(GL_DEBUG_OUTPUT_SYNCHRONOUS);
  glDebugMessageCallback(collect, &messages);
}

// Bytes of address space that Mesa's software renderer reserves for a context and its first frame. Without
// them it does not fail, but corrupts memory.
constexpr size_t kContextSpace = size_t{640} << 20;
constexpr size_t kDrawingSpace = size_t{16} << 20; // left for any further command

// Throws Error where a limit of the address space (ulimit -v) leaves less.
void requireAddressSpace(size_t bytes) {
  rlimit limit{};
  if (getrlimit(RLIMIT_AS, &limit) != 0 || limit.rlim_cur == RLIM_INFINITY) return;
  void* const space = mmap(nullptr, bytes, PROT_NONE, MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
  if (space == MAP_FAILED)
    throw Error(std::to_string(bytes >> 20) + " MiB of address space are needed, more than the limit of " +
                std::to_string(limit.rlim_cur >> 20) + " MiB leaves (ulimit -v): out of memory")
        .in("OpenGL");
  munmap(space, bytes);
}

// State that no object of this folder changes later.
void setConventions() {
  glClipControl(GL_UPPER_LEFT, GL_ZERO_TO_ONE);
  glPixelStorei(GL_PACK_ALIGNMENT, 1);
  glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
  glEnable(GL_FRAMEBUFFER_SRGB); // concerns sRGB attachments alone
  glDisable(GL_DITHER);
}

} // namespace

struct Context::State {
  EGLDisplay display = EGL_NO_DISPLAY;
  EGLContext context = EGL_NO_CONTEXT;
  Description description;
  Messages messages;

  // Displays are shared by all contexts of the process, so they are not terminated.
  ~State() {
    if (context == EGL_NO_CONTEXT) return;
    eglMakeCurrent(display, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
    eglDestroyContext(display, context);
  }

  bool openOn(EGLDisplay candidate) {
    EGLContext created = contextOf(candidate, true);
    if (created == EGL_NO_CONTEXT) return false;
    if (!eglMakeCurrent(candidate, EGL_NO_SURFACE, EGL_NO_SURFACE, created)) {
      eglDestroyContext(candidate, created);
      return false;
    }
    display = candidate;
    context = created;
    return true;
  }
};

Context::Context(const ContextOptions& options) : state_(std::make_unique<State>()) {
  requireLibrary("libEGL.so.1", "libegl1");
  requireLibrary("libGL.so.1", "libgl1");
  if (eglGetCurrentContext() != EGL_NO_CONTEXT) throw Error("this thread has a context already").in("OpenGL");

  requireAddressSpace(kContextSpace);
  constexpr const char* kDriver = "a driver (Debian: libegl-mesa0 and libgl1-mesa-dri)";
  std::optional<std::string> older;
  for (EGLDisplay display : displays(options.software)) {
    EGLint major = 0, minor = 0;
    if (display == EGL_NO_DISPLAY || !eglInitialize(display, &major, &minor) || !eglBindAPI(EGL_OPENGL_API))
      continue;
    if (state_->openOn(display)) break;
    if (!older) older = olderVersion(display);
  }
  if (state_->context == EGL_NO_CONTEXT && older) throw mismatch("4.5 core", *older).at("version");
  if (state_->context == EGL_NO_CONTEXT) throw mismatch(kDriver, "none").at("EGL");

  collectErrors(state_->messages);
  setConventions();
  state_->description = {text(GL_RENDERER),
                         text(GL_VERSION),
                         text(GL_VENDOR),
                         {number(GL_MAX_TEXTURE_SIZE), number(GL_MAX_ARRAY_TEXTURE_LAYERS),
                          number(GL_MAX_TEXTURE_IMAGE_UNITS), number(GL_MAX_COLOR_ATTACHMENTS)}};
  requireNoErrors();
}

Context::~Context() = default;

const Description& Context::describe() const { return state_->description; }

std::string Context::driver() const { return "driver " + describe().renderer + " " + describe().version; }

std::shared_ptr<const Context> contextOfThread() {
  thread_local std::weak_ptr<const Context> kept;
  std::shared_ptr<const Context> context = kept.lock();
  if (context) return context;
  kept = context = std::make_shared<const Context>();
  return context;
}

void requireNoErrors() {
  assert(eglGetCurrentContext() != EGL_NO_CONTEXT);
  requireAddressSpace(kDrawingSpace);
  void* user = nullptr;
  glGetPointerv(GL_DEBUG_CALLBACK_USER_PARAM, &user);
  auto& messages = *static_cast<Messages*>(user);
  if (messages.empty()) return;
  const std::string first = messages.front();
  messages.clear();
  if (first.starts_with("GL_OUT_OF_MEMORY")) throw Error("out of memory (" + first + ")").in("OpenGL");
  throw mismatch("no error", first);
}

void finish() {
  glFinish();
  requireNoErrors();
}

} // namespace surflect::gl
