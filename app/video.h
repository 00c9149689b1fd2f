// Video: pictures into a film file (.mp4, .webm, .mkv, .mov or .gif) through the program ffmpeg, which gets them by a
// pipe. The file appears whole or not at all.

#ifndef RAYFOLD_APP_VIDEO_H
#define RAYFOLD_APP_VIDEO_H

#include "say.h"

#define VIDEO_OUTPUTS ".mp4|.webm|.mkv|.mov|.gif"

typedef struct Video Video;

// Starts ffmpeg. width and height of the pictures. On failure *out is NULL.
ExitCode video_begin(Video **out, const char *path, int width, int height, double fps);

// display-linear rgba, 0..1, as rf_develop() makes it.
ExitCode video_add(Video *v, const rf_image *picture);

// Waits for ffmpeg to end and gives the file its name.
ExitCode video_finish(Video *v);

// Ends ffmpeg and removes what it wrote. Accepts NULL.
void video_drop(Video *v);

#endif
