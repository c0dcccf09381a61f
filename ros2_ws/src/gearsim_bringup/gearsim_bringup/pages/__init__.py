"""What all pages share: style, plots as plotly.js takes them, a template filled in, a folder made whole."""
