"""What tests share: rigs, logs and daemons made for them, a browser, a visitor of the page. Programs that a person
starts stand beside this folder."""
