/* MODEL_EXPORT marks functions of a model that other programs load from the FMU's binary. */
#ifndef EXPORT_H
#define EXPORT_H

#if defined _WIN32 || defined __CYGWIN__
#define MODEL_EXPORT __declspec(dllexport)
#else
#define MODEL_EXPORT __attribute__((visibility("default")))
#endif

#endif
